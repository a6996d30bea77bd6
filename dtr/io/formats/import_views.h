// dtr/io/formats/import_views.h -- D+TR sets out of others' cameras, images and depth maps.
#pragma once
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/types/sparse_scene.h"
#include "dtr/types/view.h"

namespace dtr::io {

/// Where the files of a CameraList lie and what their numbers mean.
struct ImportOptions {
  std::filesystem::path images_dir;
  std::filesystem::path depth_dir;  ///< empty: views stay without depth, for `dtr stereo`
  std::filesystem::path mask_dir;   ///< empty: a folder `masks` beside images_dir
  /// What the depth numbers measure; empty: what the list says for each camera.
  std::optional<DepthKind> depth_kind;
  /// Scene units per number in a depth file. Empty: 1 for float files; 16-bit PNG is refused, as
  /// its numbers are never scene units by themselves.
  std::optional<double> depth_unit;
  std::set<std::string> held_out;  ///< names of the list: camera and image are kept, depth is not
  DepthCoding depth_coding = DepthCoding::kPng16InverseDepth;
  int threads = 0;  ///< 0: all cores; the set does not depend on it
  /// Views in memory at a time take at most so many 1e9 bytes (one alone may be larger); 0: no
  /// bound.
  double memory_gb = 0;
};

/// One view with its pixels. The depth file is the list's, else the only file of depth_dir with the
/// photo's name and the extension .exr, .pfm, .png or .tif; ray distances become plane z. Pixels
/// without depth are holes, never guessed. near_z and far_z are left to the writer.
/// Transparent pixels are masked (ReadImageAndMask), and a mask file must allow a pixel as well.
/// What is masked has no depth. Throws Error, naming the file, when an image, depth map or mask is
/// absent, damaged or of another size than its camera, or when the image has an EXIF orientation
/// (its camera is then ambiguous).
View ImportView(const NamedCamera& named, const std::string& id, const ImportOptions& options);

/// All views of a list, in its order, ready for SetWriter::WriteView: everything in memory at once.
/// Throws like ImportView, and UsageError for a held-out name that is not in the list.
std::vector<View> ImportViews(const CameraList& list, const ImportOptions& options);

/// `dtr import`: writes a whole set at `target`.
/// The world is recentred (RecentreWorld), centre, bounds and reference baselines come from the
/// depth, or from `points` where there is none. `points` (world of the list, views = indices into
/// it) become the set's sparse scene; null: none. Views go through memory a few at a time.
/// Throws UsageError when `target` exists without `force` or neither depth nor points are given;
/// Error like ImportView. Returns what the alpha of the images said. A failure or interruption
/// leaves nothing behind.
AlphaTotals ImportSet(const CameraList& list, const ImportOptions& options,
                      const std::filesystem::path& target, bool force, const SparseScene* points,
                      Progress& progress);

}  // namespace dtr::io
