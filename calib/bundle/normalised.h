// calib/bundle/normalised.h -- internal to calib/bundle: a bundle in the solver's coordinates.
#pragma once
#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "calib/bundle/bundle.h"
#include "calib/bundle/observation_cost.h"

namespace dtr::calib {

/// A bundle around the place where a solve starts: the world moved so that the cameras' mean centre
/// is the origin, and scaled so that their centres are 1 from it (root mean square), or, where all
/// stand in one place, the points' median distance is. Offsets of 1e6 and scales of 1e-6 to 1e6
/// therefore change nothing but rounding.
struct Normalised {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double unit = 1;  ///< world units per unit here
  std::vector<LensFrame> lenses;
  std::vector<PoseFrame> poses;
  std::vector<PointFrame> points;
  std::vector<std::array<double, kMaxParams>> theta;
  std::vector<std::array<double, 6>> motion;
  std::vector<std::array<double, 3>> place;
  /// Per image, added to its shift in units of ShiftScalePx; empty where shifts are known.
  std::vector<std::array<double, 2>> shift;

  static Normalised Around(const Bundle& bundle);
  /// The bundle at the unknowns' present values, in normalised coordinates.
  Bundle LocalAt(const Bundle& bundle) const;
  /// Takes a bundle from normalised coordinates back into the world.
  void ToWorld(Bundle& bundle) const;
  /// The images of a rig, and one motion a frame; empty where every image moves for itself.
  std::vector<RigMember> members;
  std::vector<int> frames;  ///< per image
  std::vector<std::array<double, 6>> rig_motion;
  /// The unknowns that move an image: its own, or its frame's.
  double* MotionOf(size_t image) {
    return members.empty() ? motion[image].data()
                           : rig_motion[static_cast<size_t>(frames[image])].data();
  }
  /// Pixels of an image's shift per unit of its unknown: those of the lens's principal point.
  double ShiftScalePx(const Bundle& bundle, size_t image) const;
  /// Carries the frames' motions to their images.
  void FollowRig();

  /// Centre of a camera and a point's place (homogeneous) in normalised coordinates.
  Eigen::Vector3d Centre(size_t image) const;
  Eigen::Vector4d Place(size_t point) const;
  std::unique_ptr<ceres::CostFunction> Cost(const Bundle& bundle,
                                            const BundleObservation& observation) const;
  /// Residual in px (predicted minus observed); false where there is none.
  bool Residual(const Bundle& bundle, const BundleObservation& observation,
                Eigen::Vector2d* residual) const;
  /// Of all observations; NaN where there is none.
  std::vector<Eigen::Vector2d> Residuals(const Bundle& bundle) const;
};

}  // namespace dtr::calib
