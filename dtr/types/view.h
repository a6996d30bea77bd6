// dtr/types/view.h -- one triplet (D, I, C) of a D+TR set.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtr/types/block_cover.h"
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr {

enum class ViewRole {
  kSource,   ///< has depth; renderers draw from it
  kHeldOut,  ///< camera and image only, kept to measure with; never given to a renderer
};
/// "source" or "held_out".
const char* NameOf(ViewRole role);

/// How depth lies on disk (docs/FORMAT.md).
enum class DepthCoding {
  kExrFloat,           ///< "exr-float": float32 EXR
  kExrHalf,            ///< "exr-half": half EXR; rejects depths beyond half's range
  kPng16Millimetre,    ///< "png16-mm": 16-bit PNG, millimetres; unit metre required, <= 65.535 m
  kPng16InverseDepth,  ///< "png16-inverse": 16-bit PNG linear in 1/z between far and near
  kZstdInverseDepth,   ///< "zstd-inverse": the same in `depth_steps` steps, our own compression
};

/// What a pixel of View::depth is.
enum class DepthState : std::uint8_t {
  kMeasured = 0,   ///< found by stereo or given; also a hole
  kCompleted = 1,  ///< nothing was measured here: a surface as the views around have it
  kFar = 2,        ///< completed, without parallax: sky; drawn at View::completed_far_z
};

/// A file of the set: path relative to the set's folder, content hash (hex SHA-256), size.
struct StoredFile {
  std::string path;
  std::string sha256;
  std::uint64_t bytes = 0;
  bool operator==(const StoredFile&) const = default;
};

/// One camera of the set with what it saw. Pixels are present only after loading.
struct View {
  std::string id;    ///< unique in the set, safe as a file name
  std::string name;  ///< original photo name, kept for ever
  ViewRole role = ViewRole::kSource;

  PinholeCamera camera{1, 1, 1, 1, 0, 0};  ///< of the image grid
  Pose cam_from_world;                     ///< world: relative to DtrSet::world_origin

  ImageRgb8 image;   ///< 8-bit sRGB, size of `camera`
  Mask mask;         ///< empty: every pixel is usable
  DepthImage depth;  ///< plane z; size of `camera` / depth_scale
  /// Of each depth pixel, where completed depths are loaded with the measured ones; else empty.
  Grid<DepthState> depth_state;
  std::optional<Grid<float>> inverse_depth_sigma;  ///< std. deviation of 1/z, grid of `depth`

  DepthCoding depth_coding = DepthCoding::kPng16InverseDepth;
  int depth_steps = 0;           ///< of kZstdInverseDepth, 1...65534; 0 with other codings
  int depth_scale = 1;           ///< s: the depth map is 1/s of the image per axis
  double near_z = 0, far_z = 0;  ///< range of the stored depth; 0 for held-out views
  int completed_steps = 0;       ///< as depth_steps, of the completed depth (docs/FORMAT.md, 4.2)
  double completed_near_z = 0, completed_far_z = 0;  ///< its range; 0 where there is none
  double reference_baseline = 0;  ///< docs/FORMAT.md; the baseline of every figure in px
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();  ///< exposure towards the set's mean (SPEC 4.4)

  std::optional<StoredFile> image_file, depth_file, sigma_file, mask_file, mesh_file,
      completed_file;
  std::optional<int> image_frame;  ///< which frame of image_file, a video; empty: it is an image
  /// What depth_file, completed_file and sigma_file are differences to (docs/FORMAT.md, 4.3);
  /// empty: they are whole by themselves.
  std::optional<StoredFile> depth_base, completed_base, sigma_base;
  std::optional<StoredMesh> mesh;  ///< of mesh_file, for this very depth and mask; may be absent
  std::string extra_json;          ///< fields this version does not know, kept verbatim ("" = none)

  /// Camera of the depth grid: K scaled so that pixel (i, j)'s centre maps to s (i + 0.5, j + 0.5).
  PinholeCamera DepthCamera() const;
  Eigen::Vector3d CenterInWorld() const { return cam_from_world.TargetOriginInSource(); }
};

/// All files that a view names, bases included, those that it has.
std::vector<const StoredFile*> StoredFilesOf(const View& view);
/// The depth map without what was completed.
DepthImage MeasuredDepth(const View& view);
/// What was completed of it alone, 0 elsewhere; empty where nothing was.
DepthImage CompletedDepth(const View& view);
/// Puts completed depths into the holes of the view's measured depth map, of the same size, and
/// says so in depth_state; what is at least completed_far_z is far. An empty map changes nothing.
void AddCompletedDepth(const DepthImage& completed, View& view);
/// The view without depth and all that goes with it, as before any was found.
void DropDepth(View& view);

/// True where somebody means the photo `name` by `word`: with its extension or without.
bool IsCalled(const std::string& name, const std::string& word);

}  // namespace dtr
