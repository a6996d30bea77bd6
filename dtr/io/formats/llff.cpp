#include "dtr/io/formats/llff.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/npy.h"
#include "dtr/io/formats/plausible_intrinsics.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

constexpr size_t kRowNumbers = 17;

PinholeCamera CameraFrom(double height_px, double width_px, double focal_px,
                         const SizedImage& image, const std::string& where) {
  const auto is_size = [](double v) {
    return v == std::floor(v) && v >= 1 && v <= kMaxImageSidePx;
  };
  if (!is_size(width_px) || !is_size(height_px)) {
    throw Error(where + ": expected a size in whole pixels, found " + std::to_string(width_px) +
                "x" + std::to_string(height_px));
  }
  if (!(focal_px > 0)) {
    throw Error(where + ": expected a positive focal length, found " + std::to_string(focal_px));
  }
  RequirePlausibleFocal(focal_px, focal_px, int(width_px), int(height_px), where);
  const PinholeCamera full_size(int(width_px), int(height_px), focal_px, focal_px, width_px / 2,
                                height_px / 2);
  return ScaledToImage(full_size, image, where);
}

}  // namespace

LlffCameras ReadLlff(const std::filesystem::path& poses_bounds, std::vector<SizedImage> images) {
  const NpyArray array = ReadNpy(poses_bounds);
  const std::string source = poses_bounds.string();
  if (array.shape.size() != 2 || array.shape[1] != kRowNumbers || array.shape[0] == 0) {
    throw Error(source + ": expected a table of 17 columns (LLFF poses and bounds), found another");
  }
  if (array.shape[0] != images.size()) {
    throw Error(source + ": expected as many rows as images, " + std::to_string(images.size()) +
                ", found " + std::to_string(array.shape[0]) +
                "; give the folder this file was made for");
  }
  std::sort(images.begin(), images.end(),
            [](const SizedImage& a, const SizedImage& b) { return a.name < b.name; });
  LlffCameras cameras;
  cameras.list.unit = LengthUnit::kUnknown;
  cameras.list.photo_grid = PhotoGrid::kStored;  // COLMAP's, from which LLFF makes the file
  for (size_t i = 0; i < images.size(); ++i) {
    const double* row = array.values.data() + i * kRowNumbers;
    const std::string where = source + ": row " + std::to_string(i) + " (" + images[i].name + ")";
    const Eigen::Map<const Eigen::Matrix<double, 3, 5, Eigen::RowMajor>> matrix(row);
    Eigen::Matrix3d world_from_cam;
    world_from_cam << matrix.col(1), matrix.col(0), -matrix.col(2);
    NamedCamera named;
    named.name = images[i].name;
    RequireSafeName(named.name, where);
    named.camera = CameraFrom(matrix(0, 4), matrix(1, 4), matrix(2, 4), images[i], where);
    named.cam_from_world =
        PoseFromCenter(world_from_cam, matrix.col(3), kPrintedRotationTolerance, where);
    const double near_z = row[15], far_z = row[16];
    if (!(near_z > 0) || !(far_z > near_z)) {
      throw Error(where + ": expected bounds 0 < near < far, found " + std::to_string(near_z) +
                  " and " + std::to_string(far_z));
    }
    cameras.list.cameras.push_back(named);
    cameras.near_z.push_back(near_z);
    cameras.far_z.push_back(far_z);
  }
  return cameras;
}

}  // namespace dtr::io
