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
#include "dtr/io/formats/foreign_confidence.h"
#include "dtr/io/image_io.h"
#include "dtr/types/sparse_scene.h"
#include "dtr/types/view.h"
#include "pipeline/core/calibration_report.h"

namespace dtr::pipeline {

/// The distortion of one camera's photos; dtr/io itself knows no camera models.
class CameraDistortion {
 public:
  virtual ~CameraDistortion() = default;
  /// Undistorts an image onto the grid of io::NamedCamera::camera, of the same size; `mask` (may be
  /// empty: all is usable) becomes 0 where the image has no source.
  virtual void Undistort(ImageRgb8& image, Mask& mask) const = 0;
  /// Where a pixel of the undistorted image lies in the photo; empty: nowhere.
  virtual std::optional<Eigen::Vector2d> DistortedPixel(const Eigen::Vector2d& pixel) const = 0;
  /// Direction of a pixel of the photo, in the camera's frame; empty: it has none.
  virtual std::optional<Eigen::Vector3d> RayFromDistorted(const Eigen::Vector2d& pixel) const = 0;
};

/// Where the files of a io::CameraList lie and what their numbers mean.
struct ImportOptions {
  std::filesystem::path images_dir;
  std::filesystem::path depth_dir;  ///< empty: views stay without depth, for `dtr stereo`
  io::ConfidenceMaps confidence;    ///< of these depth maps
  std::filesystem::path mask_dir;   ///< empty: a folder `masks` beside images_dir
  /// What the depth numbers measure; empty: what the list says for each camera.
  std::optional<DepthKind> depth_kind;
  /// Scene units per number in a depth file. Empty: 1 for float files; whole numbers are
  /// rejected, as they are never scene units by themselves.
  std::optional<double> depth_unit;
  /// io::CameraList::photo_grid of the list.
  PhotoGrid photo_grid = PhotoGrid::kUpright;
  /// Knows the models of cameras with distortion; needed where the list has such.
  std::function<std::unique_ptr<CameraDistortion>(const io::NamedCamera&)> distortion_of;
  std::set<std::string> held_out;  ///< names of the list: camera and image are kept, depth is not
  DepthCoding depth_coding = DepthCoding::kPng16InverseDepth;
  int threads = 0;  ///< 0: all cores; the set does not depend on it
  /// Views in memory at a time take at most so many 1e9 bytes, and one that alone takes more is
  /// rejected; 0: no bound.
  double memory_gb = 0;
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
