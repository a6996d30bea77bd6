// dtr/io/formats/cameras_json.h -- cameras.json, the project's list of known cameras.
//
// One JSON object (docs/CONVENTIONS.md has a worked example):
//   unit          optional: "unknown" | "arbitrary" | "metre"; absent = "unknown"
//   world_origin  optional: [x, y, z]; poses act on p_world - world_origin; absent = [0, 0, 0]
//   views[]       name, width, height, fx, fy, cx, cy, cam_from_world (4x4, row-major), and
//                 optional depth, depth_kind ("z" | "ray"; absent = "z"), mask
// Pixels: the centre of the first pixel is (0.5, 0.5). Camera axes: x right, y down, z forward.
// name, depth and mask are paths relative to the folders of images, depth maps and masks, which
// whoever reads the list knows. Fields not named here are ignored.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dtr/types/camera.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/photo_grid.h"
#include "dtr/types/pose.h"

namespace dtr::io {

/// A camera model with distortion, in COLMAP's words: the name ("OPENCV") and the parameters in
/// its order, focal lengths and principal point first. What it means is for calib to say.
struct Distortion {
  std::string model;
  std::vector<double> params;
  bool operator==(const Distortion&) const = default;
};

/// A camera of a list with the names of the files that belong to it.
struct NamedCamera {
  std::string name;        ///< photo, relative to the folder of images; unique in the list
  std::string depth_file;  ///< relative to the folder of depth maps; empty: none
  std::string mask_file;   ///< relative to the folder of masks; empty: none
  DepthKind depth_kind = DepthKind::kPlaneZ;  ///< what the numbers of `depth_file` measure
  PinholeCamera camera{1, 1, 1, 1, 0, 0};     ///< of the image, once it is undistorted
  Pose cam_from_world;                        ///< world: relative to CameraList::world_origin
  /// Of the image as it is; empty: none.
  std::optional<Distortion> distortion = std::nullopt;
};

/// Cameras of one scene.
struct CameraList {
  LengthUnit unit = LengthUnit::kUnknown;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();  ///< poses act on p_world - world_origin
  std::vector<NamedCamera> cameras;
  /// The pixels that cameras describe of photos with an EXIF orientation, where both ways have the
  /// camera's size: cameras.json is of upright photos.
  PhotoGrid photo_grid = PhotoGrid::kUpright;
};

/// Longest image side any reader of camera lists accepts; keeps a hostile size from becoming an
/// allocation.
inline constexpr int kMaxImageSidePx = 1 << 16;

/// The list in a file. Throws Error naming the file and the field unless all numbers are finite,
/// focal lengths positive, sizes in [1, kMaxImageSidePx], names unique and without a way out of
/// their folder, the last matrix row 0 0 0 1 and the upper left 3x3 block a rotation to 1e-6 (then
/// the nearest rotation is taken and the camera's centre kept).
CameraList ReadCamerasJson(const std::filesystem::path& file);

/// The same from text; `source` is what messages call it.
CameraList ParseCamerasJson(std::string_view text, const std::string& source);

/// Writes the list so that reading it gives the same numbers to rounding (1e-15 relative). Throws
/// Error when the file cannot be written or the list would not be read back.
void WriteCamerasJson(const std::filesystem::path& file, const CameraList& list);

/// The text WriteCamerasJson writes; the same list gives the same bytes. Throws
/// std::invalid_argument for cameras with distortion, which the file cannot hold.
std::string FormatCamerasJson(const CameraList& list);

/// Throws Error, naming `source` and a camera, where positions are beyond kMaxLength or all within
/// kMinLength of each other, but not the same.
void RequireComputable(const CameraList& list, const std::string& source);

/// Keeps stored poses small. When the camera centres lie farther from 0 than 100 times their
/// spread, world_origin moves by their centroid, rounded to multiples of a power of two near the
/// spread (whole units at usual scales) so that sums stay exact in double; the cameras stay where
/// they are in the user's world. Else the list as it is.
/// Computed in extended precision: the loss is that of the poses that came in (half an ulp of their
/// translations), not of the move.
CameraList RecentreWorld(CameraList list);

}  // namespace dtr::io
