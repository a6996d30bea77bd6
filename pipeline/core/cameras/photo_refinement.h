// pipeline/core/cameras/photo_refinement.h -- bundle adjustment of what structure from motion
// found.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/core/calibrate.h"
#include "pipeline/core/photos/camera_groups.h"

namespace dtr::pipeline {

/// A model after it.
struct PhotoRefinement {
  calib::SfmModel model;
  LengthUnit unit = LengthUnit::kArbitrary;
  /// `rig` or `bundle_adjustment`, `camera_sharing`; none where not asked for.
  CalibrationReport report;
  std::vector<std::string> notes;  ///< for people; said already
  /// What it took an earlier call, whose result this is; 0 where it was worked out just now.
  double earlier_wall_s = 0, earlier_cpu_s = 0;
};

/// Merges cameras of several folders where held-out observations allow it
/// (ChooseFolderCameras), then brings the frozen model of `sfm_folder` (COLMAP's files, which
/// `model` was read from) to the rig, the lens, the metres or the lens freedom that `options` ask
/// for: SetRig, calib::Refine, RefineInMetres. The result is kept in `folder` and read back by a
/// later call with the same model, photos and options: hundreds of photos take half an hour. Throws
/// Error as those do, Interrupted where `progress` asks for it.
PhotoRefinement RefinePhotos(const capture::Capture& capture, const CalibrateOptions& options,
                             const CameraGroups& groups, const calib::SfmModel& model,
                             const std::filesystem::path& sfm_folder,
                             const std::filesystem::path& folder, Progress& progress);

}  // namespace dtr::pipeline
