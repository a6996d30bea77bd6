// dtr/io/formats/llff.h -- poses_bounds.npy of LLFF (Mildenhall et al., SIGGRAPH 2019) and of the
// many NeRF data sets made with its scripts.
//
// One row of 17 numbers per image, images in byte order of their names: a 3x5 matrix, row-major,
// whose columns are the camera's axes [down, right, backwards] in the world, its centre, and
// [height, width, focal] of the full-size image; then the near and far depth of the scene there.
// The principal point is the image centre. The matrices come out of COLMAP, so the world is
// COLMAP's (unit arbitrary) and pixels have their origin in the corner. Lens distortion is not in
// the format.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/sized_image.h"

namespace dtr::io {

/// Cameras with the depth range LLFF noted for each.
struct LlffCameras {
  CameraList list;
  std::vector<double> near_z, far_z;  ///< z, world units, per camera
};

/// Cameras of `images`, which must be as many as the rows and are paired with them in byte order of
/// their names. K is scaled from the size in the file to the image's size, per axis.
/// Throws Error for a damaged file, another number of rows, bounds that are not 0 < near < far, a
/// pose that is no rotation (kPrintedRotationTolerance) or an image whose shape is not the one in
/// the file (1 % of the aspect ratio: released images are scaled to whole pixels).
LlffCameras ReadLlff(const std::filesystem::path& poses_bounds, std::vector<SizedImage> images);

}  // namespace dtr::io
