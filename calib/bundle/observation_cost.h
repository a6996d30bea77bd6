// calib/bundle/observation_cost.h -- internal to calib/bundle: one observation's residual, for
// Ceres.
#pragma once
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "calib/bundle/bundle.h"

namespace dtr::calib {

/// The solver's coordinates. Every unknown is a number near zero, of order one:
///   lens    params = centre + scale * theta
///   pose    p_in_cam ~ exp(w) R (p - (centre + v)): a turn w about the camera's own centre, in
///           radians along its axes, and a shift v of the centre, in units of the normalised world
///   point   p ~ anchor + (d + a e1 + b e2) / rho: a direction from a fixed place (the centre of a
///           camera that sees it, where the solve starts) and an inverse distance. rho = 0 is a
///           point at infinity, where nothing special happens (Civera et al. 2008).
/// The projection needs p only up to a positive factor: d + rho (anchor - centre - v).
inline constexpr size_t kMaxParams = 12;
struct LensFrame {
  CameraModel model = CameraModel::kPinhole;
  std::vector<double> centre, scale;
};
struct PoseFrame {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};
struct PointFrame {
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ(), e1, e2;  ///< an orthonormal frame
  double rho = 0;  ///< where the solve starts; the unknown is added to it
};

/// Scales of a lens's parameters such that one unit of each moves the pixels at the edge of what is
/// seen, |q| = largest_radius on the plane of LensFormula, by about as much: the focal length in px
/// times largest_radius.
LensFrame FrameAround(const LensCamera& lens, double largest_radius);
std::vector<double> ParamsAt(const LensFrame& frame, const double* theta);
PointFrame FrameAround(const Eigen::Vector4d& point, const Eigen::Vector3d& anchor);

/// A camera on a rig: its motion follows from the rig's, which has the same form about the rig's
/// own origin.
struct RigMember {
  Eigen::Matrix3d cam_from_rig = Eigen::Matrix3d::Identity();  ///< rotation
  Eigen::Matrix3d world_from_rig =
      Eigen::Matrix3d::Identity();                          ///< rotation, where the solve starts
  Eigen::Vector3d centre_in_rig = Eigen::Vector3d::Zero();  ///< in the normalised unit

  /// With p_in_rig ~ exp(w) R (p - (c + v)): the camera turns by cam_from_rig w, and its centre
  /// moves by v + R^T (exp(-w) - 1) centre_in_rig.
  template <typename T>
  void Motion(const T* rig_motion, T* motion) const {
    const T back[3] = {-rig_motion[0], -rig_motion[1], -rig_motion[2]};
    const T arm[3] = {T(centre_in_rig[0]), T(centre_in_rig[1]), T(centre_in_rig[2])};
    T turned[3];
    ceres::AngleAxisRotatePoint(back, arm, turned);
    for (int i = 0; i < 3; ++i) {
      motion[i] = T(0);
      motion[3 + i] = rig_motion[3 + i];
      for (int k = 0; k < 3; ++k) {
        motion[i] += cam_from_rig(i, k) * rig_motion[k];
        motion[3 + i] += world_from_rig(i, k) * (turned[k] - arm[k]);
      }
    }
  }
};

/// What not every observation has; one of the two at most.
struct ObservationExtras {
  const RigMember* member = nullptr;  ///< borrowed; the pose block is the rig's
  /// Above 0: a fourth block of two numbers, times this, moves the image's principal point.
  double shift_scale_px = 0;
};

/// Predicted minus observed pixel; parameter blocks lens, pose (w, v), point (a, b, rho). Fails
/// where the point has no pixel. The frames are borrowed.
std::unique_ptr<ceres::CostFunction> ObservationCost(const LensFrame& lens, const PoseFrame& pose,
                                                     const PointFrame& point,
                                                     const Eigen::Vector2d& observed_px,
                                                     const ObservationExtras& extras = {});

}  // namespace dtr::calib
