// datasets/make.h -- synthetic photo collections on disk, with truth.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/pose.h"

namespace dtr::datasets {

/// Everything that decides the bytes of a collection.
struct DatasetSpec {
  std::string scene = "courtyard";
  std::string layout;  ///< empty: the scene's default
  int views = 16;
  int width_px = 960, height_px = 640;
  double focal_35mm = 28;     ///< for a frame 36 mm wide: fx = fy = focal_35mm / 36 * width
  int supersampling = 3;      ///< n x n rays per pixel of a photo
  double noise = 0;           ///< std. deviation, 8-bit levels
  double exposure_drift = 0;  ///< stops from the first photo to the last; the middle has gain 1
  double k1 = 0, k2 = 0;      ///< lens of the photos (datasets/render_truth.h, RadialLens)
  bool fisheye = false;       ///< it is a fisheye
  std::uint64_t seed = 1;     ///< of textures and noise
  /// The written world: p_written = scale * p_scene + world_offset. Photos and masks are rendered
  /// in the scene's own frame and do not depend on either, to the byte; written poses and depths
  /// are transformed.
  Eigen::Vector3d world_offset = Eigen::Vector3d::Zero();
  double scale = 1;
  /// Photos are whole equirectangular panoramas of `width_px` x width_px / 2, in panoramas/; the
  /// views of a cube around each are rendered as pinhole cameras would, in images/ and depth/.
  /// height_px, focal_35mm and the lens play no part.
  bool panoramas = false;
  double time_s = 0;  ///< the time step, where something moves (MakeScene); the first of several
  /// Several: what the fixed cameras of a rig saw (make_dynamic.h), in another layout of files.
  int steps = 1;
  int steps_per_second = 10;
  bool videos = false;  ///< of several time steps: a video per camera instead of photos
  int jpeg_quality = 95;
};

/// The spec of a scene before anything is asked for: the members' defaults, and of a scene made for
/// several time steps, small photos of few cameras.
DatasetSpec DefaultSpecOf(const std::string& scene);

/// Linear exposure factor of photo `i` of `views`: 2^(drift * (i / (views - 1) - 1/2)).
double ExposureGain(double drift_stops, int i, int views);

/// cam_from_world of the written world (see DatasetSpec) from that of the scene. Lengths in the
/// camera frame are `scale` times the scene's.
Pose WrittenPose(const Pose& cam_from_scene, double scale, const Eigen::Vector3d& world_offset);

/// Renders the collection into `out_folder`:
///   images/NNNN.jpg          photos, 4:4:4, EXIF focal length; distorted if the spec has a lens
///   cameras.json             the ideal pinhole cameras (docs/CONVENTIONS.md)
///   depth/NNNN.exr           plane z at pixel centres of the ideal pinhole grid, float32
///   masks/NNNN_visible.png   255: the surface point is seen by at least 2 other views
///   masks/NNNN_texture.png   255: textured, evaluated on the ideal grid and before noise
///   dataset.json, SOURCE.md  how it was made
/// With `panoramas`: panoramas/NNNN.jpg (XMP GPano), and of each view of the cube (FaceSizePx)
/// images/FACE/NNNN.jpg, depth/FACE/NNNN.exr and a camera FACE/NNNN.jpg in cameras.json; no masks.
/// With several time steps: as MakeDynamicDataset.
/// The folder appears when all is done, under its name with ".partial" before.
/// Throws UsageError when it exists or the spec is out of range (naming the field), Error when
/// something cannot be written.
void MakeDataset(const DatasetSpec& spec, const std::filesystem::path& out_folder,
                 Progress& progress);

/// dataset.json and back: MakeDataset with what was read gives the same bytes again.
/// Reading throws Error naming the field that is missing or wrong.
std::string FormatSpecJson(const DatasetSpec& spec);
DatasetSpec ParseSpecJson(const std::string& text, const std::string& source);

}  // namespace dtr::datasets
