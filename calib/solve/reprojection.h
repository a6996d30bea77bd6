// calib/solve/reprojection.h -- internal to calib/solve: one corner's residual, for Ceres.
#pragma once
#include <ceres/ceres.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "calib/models/board_model.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// Lens parameters as the solver sees them: params = centre + scale * theta, theta near zero and of
/// order one whatever the unit. The scales are such that one unit of any theta moves the pixels at
/// the edge of what was seen by about as much.
struct LensCoordinates {
  BoardModel model = BoardModel::kPinhole;
  std::array<double, kMaxLensParameters> centre{}, scale{};
};

/// Coordinates around `camera` for corners drawn at up to `largest_radius` on the plane of
/// LensFormula.
LensCoordinates CoordinatesAround(BoardModel model, const LensCamera& camera,
                                  double largest_radius);

/// Indices of a model's radial coefficients, of the lowest power first; none of a pinhole, which has
/// no such coefficients, nor of brown8, whose mean something as a quotient only.
std::vector<int> RadialTerms(BoardModel model);

/// What is expected of radial coefficients before any corner is seen: that each displaces the
/// image's corner, at `border_radius` on the plane of LensFormula, by 0 +- 30 % of its distance.
/// Weighs as much as one corner of `sigma_px`, so it is felt only where corners say less than that
/// about a coefficient: polynomials of high degree then stay near those of lower degree in place of
/// following what is no lens. Parameter block theta. Null where there are no RadialTerms.
std::unique_ptr<ceres::CostFunction> RadialPrior(const LensCoordinates& lens, double border_radius,
                                                 double sigma_px);

/// Distance of the image's corners from its middle on the plane of LensFormula, without distortion.
double BorderRadius(const LensCamera& camera);

/// A board's pose as the solver sees it: six numbers (w, v) that stand for
///   p_in_cam = exp(w) R (p_in_board - pivot) + translation + scale * v,
/// a rotation w about the pivot, in radians and along the camera's axes, and a shift v.
struct PoseCoordinates {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< of the pivot in the camera frame
  double scale = 1;
};

PoseCoordinates CoordinatesAround(const Pose& cam_from_board, const Eigen::Vector3d& pivot);
/// The pose at the coordinates (w, v).
Pose PoseAt(const PoseCoordinates& coordinates, const double motion[6],
            const Eigen::Vector3d& pivot);

/// Predicted minus observed pixel of a corner; parameter blocks theta and (w, v). Fails where the
/// corner has no pixel. `lens`, `pose` are borrowed. `corner` is p_in_board - pivot.
std::unique_ptr<ceres::CostFunction> ReprojectionCost(const LensCoordinates& lens,
                                                      const PoseCoordinates& pose,
                                                      const Eigen::Vector3d& corner,
                                                      const Eigen::Vector2d& observed_px);

/// The same with the lens as given, of any model but kFov; parameter block (w, v) alone. For
/// cameras of a rig the pose is rig_from_board, and `cam_from_rig` is given too.
std::unique_ptr<ceres::CostFunction> PoseCost(const LensCamera& camera, const PoseCoordinates& pose,
                                              const Eigen::Vector3d& corner,
                                              const Eigen::Vector2d& observed_px,
                                              const Pose& cam_from_rig = {});

/// The same for a camera of a rig; parameter blocks theta, (w, v) of cam_from_rig, about the rig's
/// origin, and (w, v) of rig_from_board, about the board's pivot.
std::unique_ptr<ceres::CostFunction> RigCost(const LensCoordinates& lens,
                                             const PoseCoordinates& cam_from_rig,
                                             const PoseCoordinates& rig_from_board,
                                             const Eigen::Vector3d& corner,
                                             const Eigen::Vector2d& observed_px);

}  // namespace dtr::calib
