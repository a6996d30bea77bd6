// pipeline/import/import.h -- D+TR sets out of others' cameras, images and depth maps.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/contents.h"
#include "dtr/base/progress.h"
#include "dtr/io/image_io.h"
#include "dtr/types/view.h"
#include "pipeline/core/calibration_report.h"

namespace dtr::pipeline {

struct ImportRequest {
  std::filesystem::path cameras;  ///< a file or folder of a format that CameraFormats() names
  std::string format;             ///< one of them; empty: by the content of `cameras`
  std::filesystem::path images;   ///< folder of the images; empty: a capture's own
  std::filesystem::path depth;    ///< folder of depth maps; empty: a capture's own, or points alone
  std::filesystem::path masks;    ///< empty: where `cameras` says, else `masks` beside the images
  /// To test the cameras: no depth, not that of a capture either, and no view is held out.
  bool cameras_alone = false;
  std::optional<DepthKind> depth_kind;  ///< empty: what `cameras` says of each
  std::optional<double> depth_unit;     ///< scene units per number of a depth map
  std::string holdout;                  ///< "", "every:N" or names: views without depth
  bool allow_missing = false;           ///< leave out cameras whose photo is not there
  std::filesystem::path output;         ///< NAME.dtr
  bool force = false;                   ///< replace a set that exists
  bool refine = false;                  ///< adjust the cameras, where held-out observations gain
  bool completion = true;               ///< of depth that is imported (CompleteDepth)
  double memory_gb = 4;                 ///< for views in memory at a time
  std::uint64_t seed = 0;
};

struct ImportReport {
  size_t views = 0, held_out = 0;
  io::AlphaTotals alpha;
  std::vector<std::pair<std::string, std::string>> skipped;  ///< camera, reason
  std::vector<std::string> notes;                            ///< what was logged, a line each
  /// What tests and adjustment of the cameras gave: given_cameras, bundle_adjustment, points.
  CalibrationReport calibration;
  capture::FolderContents contents;  ///< of the folder of images
};

/// Writes a whole set. Distorted photos are undistorted; a set without depth maps gets the points
/// of the cameras' file, or those that are triangulated from the photos. With `refine` the cameras
/// are adjusted to these points where held-out observations gain; world and unit stay. Throws
/// UsageError when the output exists (without force) and for `refine` with depth maps, Error for a
/// file that is absent, damaged or of another size. A failure or an interruption leaves nothing
/// behind.
ImportReport Import(const ImportRequest& request, Progress& progress);

}  // namespace dtr::pipeline
