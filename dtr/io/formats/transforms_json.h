// dtr/io/formats/transforms_json.h -- transforms.json of NeRF, instant-ngp and nerfstudio.
//
// Poses are camera-to-world with OpenGL axes (x right, y up, z back). Intrinsics stand at the top
// or in each frame: fl_x, fl_y, cx, cy, w, h, or camera_angle_x alone (NeRF's synthetic scenes: f =
// w / 2 / tan(angle / 2), principal point at the image centre). cx, cy are used as they are: these
// programs copy them from COLMAP or shoot rays through pixel + 0.5, so the origin is the corner.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/sized_image.h"

namespace dtr::io {

/// Cameras of a transforms.json; unit arbitrary, depth_kind z where depth files are named.
/// `image_of` is given each file_path (relative, without a leading "./") and returns the image that
/// is there and its size: NeRF's own files leave the extension away and images may have been scaled
/// since; intrinsics given for another size (w, h) are scaled per axis. It throws Error if there is
/// no such image.
/// Throws Error for lens distortion that is not zero or a fisheye camera (undistort first), for
/// missing intrinsics, poses that are no rotations (kPrintedRotationTolerance) and unsafe names.
CameraList ReadTransformsJson(const std::filesystem::path& file,
                              const std::function<SizedImage(const std::string&)>& image_of);

}  // namespace dtr::io
