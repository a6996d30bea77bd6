// calib/colmap/own_held_out.h -- the pose of a photo in a frozen model, by calib/sfm.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "calib/colmap/sfm.h"
#include "calib/sfm/view_graph.h"

namespace dtr::colmap {

/// A registered photo of a frozen model, its features in the order of the model's image.
struct SourceView {
  const calib::SfmImage* image = nullptr;
  const calib::LensCamera* lens = nullptr;
  sfm::Features features;
};

/// A photo to be placed.
struct ViewToPlace {
  sfm::Features features;
  calib::LensCamera lens;       ///< where it is not known a start: EXIF's focal length, or a guess
  bool lens_is_known = false;   ///< frozen: only the pose is found
  bool focal_is_known = false;  ///< EXIF's
};

/// What was found: `image` has pose and features (those that agree with a point carry its id).
struct PlacedView {
  calib::SfmImage image;
  calib::LensCamera lens;
};

/// Matches `view` with the sources and finds the pose with which most of the points that its
/// matches name are seen where it sees them (P3P within RANSAC: Ke and Roumeliotis, CVPR 2017),
/// then least squares over those within 4 px of a photo of 1600 px; a lens that is not known gets
/// its focal length with it. Empty where fewer than `min_inliers` agree. Deterministic.
std::optional<PlacedView> PlaceView(const ViewToPlace& view, std::span<const SourceView> sources,
                                    const calib::SfmModel& model, int min_inliers,
                                    std::uint64_t seed, Progress& progress);

}  // namespace dtr::colmap
