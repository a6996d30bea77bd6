// dtr/io/formats/transforms_json.h -- transforms.json of NeRF, time step-ngp and nerfstudio.
//
// Poses are camera-to-world with OpenGL axes (x right, y up, z back). Intrinsics stand at the top
// or in each frame: fl_x, fl_y, cx, cy, w, h, or camera_angle_x alone (NeRF's synthetic scenes: f =
// w / 2 / tan(angle / 2), principal point at the image centre). cx, cy are used as they are: these
// programs copy them from COLMAP or shoot rays through pixel + 0.5, so the origin is the corner.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/sized_image.h"

namespace dtr::io {

/// How the paths of a transforms.json are found on disk. Each function is given a path as it stands
/// in the file, without a leading "./".
struct TransformsPaths {
  /// The image with its size (NeRF's own files leave the extension away); size 0: no image is
  /// needed, the camera has the size of the file. Empty: there is no such image.
  std::function<std::optional<SizedImage>(const std::string&)> image_of;
  /// Names below the folders of depth maps and masks; absent: as they stand in the file.
  std::function<std::string(const std::string&)> depth_of, mask_of;
};

/// A frame whose photo was not found.
struct FrameWithoutPhoto {
  size_t frame = 0;  ///< counted from 0
  std::string path;  ///< as the file writes it
};

/// What a transforms.json holds.
struct TransformsFile {
  CameraList list;                         ///< unit arbitrary; frames with a photo
  std::vector<FrameWithoutPhoto> missing;  ///< the other frames
  /// Images that test_filenames and val_filenames name and train_filenames does not; empty option:
  /// the file has none of these lists.
  std::optional<std::set<std::string>> held_out;
  std::optional<double> depth_unit;  ///< depth_unit_scale_factor, integer_depth_scale
  std::string points_file;           ///< ply_file_path, or empty
  std::vector<std::string> notes;    ///< one line each: what the file holds and is not used
};

/// Reads the file. Intrinsics given for another size (w, h) than the image's are scaled per axis.
/// Distortion (k1...k6, p1, p2, fisheyes) is returned as Distortion, for images as they are.
/// Throws Error for cameras that are no perspective or fisheye ones, distortion that programs read
/// in different ways, missing intrinsics, poses that are no rotations (kPrintedRotationTolerance)
/// and unsafe names.
TransformsFile ReadTransformsJson(const std::filesystem::path& file, const TransformsPaths& paths);

/// Whether a .json file is a transforms.json: it has `frames` and no `views`.
bool IsTransformsJson(const std::filesystem::path& file);

}  // namespace dtr::io
