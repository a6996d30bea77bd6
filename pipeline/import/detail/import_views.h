// pipeline/import/detail/import_views.h -- D+TR sets out of others' cameras, images and depth maps.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/types/sparse_scene.h"
#include "dtr/types/view.h"
#include "pipeline/core/calibration_report.h"
#include "pipeline/core/depth/camera_depth.h"

namespace dtr::pipeline {

/// Where the files of a io::CameraList lie and what their numbers mean.
struct ImportOptions : CameraDepthOptions {
  std::filesystem::path images_dir;
  std::filesystem::path mask_dir;  ///< empty: a folder `masks` beside images_dir
  /// io::CameraList::photo_grid of the list.
  PhotoGrid photo_grid = PhotoGrid::kUpright;
  /// Knows the models of cameras with distortion; needed where the list has such.
  std::function<std::unique_ptr<CameraDistortion>(const io::NamedCamera&)> distortion_of;
  std::set<std::string> held_out;  ///< names of the list: camera and image are kept, depth is not
  DepthCoding depth_coding = DepthCoding::kPng16InverseDepth;
  /// What tests and adjustment of the cameras gave, for the set's provenance; decides nothing.
  CalibrationReport calibration = {};
  bool completion = false;  ///< of depth that comes with the views (CompleteDepth)
};

/// Where the masks of an import lie.
std::filesystem::path MaskFolder(const ImportOptions& options);

/// One view with its pixels. The depth file is the list's, else the only file of depth_dir with the
/// photo's name and the extension .exr, .pfm, .png, .tif or .npy; ray distances become plane z, and
/// a map of a size that no set can hold is resampled (depth_grid.h). Pixels without depth are
/// holes, never guessed. near_z and far_z are left to the writer. Of an image with an EXIF
/// orientation the camera's size says which pixels are meant, those stored or those turned upright.
/// Transparent pixels are masked (io::ReadImageAndMask), and a mask file must allow a pixel as
/// well. What is masked has no depth. Throws Error, naming the file, when an image, depth map or
/// mask is absent, damaged or of another size (a depth map: shape) than its camera.
View ImportView(const io::NamedCamera& named, const std::string& id, const ImportOptions& options);

/// All views of a list, in its order, ready for io::SetWriter::WriteView: everything in memory at
/// once. Throws like ImportView, and UsageError for a held-out name that is not in the list.
std::vector<View> ImportViews(const io::CameraList& list, const ImportOptions& options);

/// `dtr import`: writes a whole set at `target`.
/// The world is recentred (io::RecentreWorld), centre, bounds and reference baselines come from the
/// depth, or from `points` where there is none. `points` (world of the list, views = indices into
/// it) become the set's sparse scene; null: none. Views go through memory a few at a time.
/// Throws UsageError when `target` exists without `force` or neither depth nor points are given;
/// Error like ImportView. Returns what the alpha of the images said. A failure or interruption
/// leaves nothing behind.
io::AlphaTotals ImportSet(const io::CameraList& list, const ImportOptions& options,
                          const std::filesystem::path& target, bool force,
                          const SparseScene* points, Progress& progress);

}  // namespace dtr::pipeline
