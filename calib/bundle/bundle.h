// calib/bundle/bundle.h -- cameras, poses, points and observations, as bundle adjustment takes
// them.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "calib/sfm_model.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::calib {

/// An image with the lens it was taken through (an index into Bundle::lenses).
struct BundleImage {
  std::string name;
  int lens = 0;
  Pose cam_from_world;
  /// How far from its lens's principal point this image has its own: optical image stabilisers move
  /// it between two photos, by some 1 % of their size.
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
};

/// Image `image` sees point `point` at `pixel`, on the image as its lens draws it.
struct BundleObservation {
  int image = 0, point = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// What bundle adjustment moves, and what it is fitted to. One gauge: any world, any unit.
struct Bundle {
  std::vector<LensCamera> lenses;
  std::vector<BundleImage> images;
  /// Homogeneous: (x, y, z, 1) is a place, (x, y, z, 0) a direction: a point at infinity.
  std::vector<Eigen::Vector4d> points;
  std::vector<BundleObservation> observations;  ///< sorted by point, then image
  std::vector<std::uint64_t> point_ids;         ///< of the model's points; empty: none
};

/// The bundle of a model; an image that shows a point twice keeps the first of the two.
/// With `separate_lenses` every image gets a lens of its own, else images share what the model
/// shares: a camera, or all of it but the principal point (LensGroups, lens_groups.h). Points
/// that fewer than two images see are left out.
Bundle BundleOf(const SfmModel& model, bool separate_lenses = false);

/// The bundle of undistorted views. Views share what the images of a model share, since one lens
/// made them. The lists belong together as in ValidateReprojection.
Bundle BundleOf(std::span<const PinholeCamera> cameras, std::span<const Pose> cam_from_world,
                std::span<const std::string> names, const SparseScene& scene);

/// `model` with the bundle's cameras, poses and points; features keep their pixels. Where images of
/// a lens have shifts, each gets a camera of its own, and the lens keeps the id it had.
/// Observations that miss their point by more than 4 px leave its track. Points that are not in the
/// bundle, lie at infinity or keep fewer than two observations leave the model; `dropped` says how
/// many. Requires a bundle that BundleOf made of this model.
SfmModel ModelOf(const Bundle& bundle, const SfmModel& model, bool separate_lenses, int* dropped);

/// Throws Error where an index is out of range, a number is not finite, a lens has the model FOV
/// (which the formula of bundle adjustment lacks), or there are fewer than two images or no
/// observations.
void CheckBundle(const Bundle& bundle);

}  // namespace dtr::calib
