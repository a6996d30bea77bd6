// cli/pipeline/known_poses.h -- cameras from a file instead of from SfM.
#pragma once
#include <filesystem>
#include <vector>

#include "calib/colmap/sfm.h"
#include "cli/pipeline/calibrated_photos.h"
#include "cli/pipeline/camera_groups.h"

namespace dtr::pipeline {

/// Photos as COLMAP gets them, with the groups that share intrinsics; `folder` is what
/// capture::PrepareSfmImages fills.
std::vector<colmap::SfmImageInput> SfmInputs(const capture::Capture& capture,
                                             const CameraGroups& groups,
                                             const std::filesystem::path& folder);
colmap::SfmOptions SfmOptionsFor(const CalibrateOptions& options);

/// Cameras from options.poses: the folder of a COLMAP model, a cameras.json or a poses_bounds.npy.
/// A COLMAP model brings its points; for the other two, points are triangulated with the cameras
/// held fixed, from photos that are not held out. Cameras far from the origin get a world origin
/// near them (io::RecentreWorld). Photos that the file does not name stay without a camera. Throws
/// Error when the file is broken or names too few of the photos.
CalibratedPhotos FromKnownPoses(const capture::Capture& capture, const CalibrateOptions& options,
                                const std::filesystem::path& workspace, Progress& progress);

/// Adds the poses of held-out photos to a model that was made without them. Nothing else of the
/// model changes; photos that cannot be registered are left out.
void RegisterHeldOutPhotos(const capture::Capture& held_out,
                           const std::vector<colmap::SfmImageInput>& sources,
                           const CameraGroups& groups, const std::filesystem::path& workspace,
                           const colmap::SfmOptions& options, calib::SfmModel& model,
                           Progress& progress);

}  // namespace dtr::pipeline
