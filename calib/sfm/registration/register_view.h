// calib/sfm/registration/register_view.h -- the pose of a photo in a model that stays as it is.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "calib/sfm/view_graph.h"
#include "calib/sfm_model.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

/// A registered photo of a model, its features in the order of the model's image.
struct SourceView {
  const calib::SfmImage* image = nullptr;
  const calib::LensCamera* camera = nullptr;
  Features features;
};

/// A photo without a pose.
struct UnregisteredView {
  Features features;
  calib::LensCamera camera;      ///< where it is not known a start: EXIF's focal length, or 1.2 w
  bool camera_is_known = false;  ///< fixed: only the pose is found
  bool focal_is_known = false;   ///< EXIF's
};

/// `image` has the pose and all features; those that agree with a point carry its id.
struct RegisteredView {
  calib::SfmImage image;
  calib::LensCamera camera;
};

/// Matches `view` with the sources and finds the pose with which most of the points that its
/// matches name project to where it observes them (FindPose), then least squares over those within
/// 4 px of a photo of 1600 px; a camera that is not known gets its focal length with it, within
/// half and twice its start. Empty where fewer than `min_inliers` observations agree.
/// Deterministic. Throws Interrupted when `progress` says so.
std::optional<RegisteredView> RegisterView(const UnregisteredView& view,
                                           std::span<const SourceView> sources,
                                           const calib::SfmModel& model, int min_inliers,
                                           std::uint64_t seed, Progress& progress);

}  // namespace dtr::sfm
