#include "python/core/camera.h"

#include <fmt/format.h>

#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/types/computable.h"

namespace dtr::python {

Eigen::Matrix3d MatrixOf(const PinholeCamera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0, 0, 1;
  return k;
}

PinholeCamera CameraFrom(const Eigen::Matrix3d& k, int width_px, int height_px,
                         const std::string& what) {
  if (width_px < 1 || height_px < 1 || width_px > io::kMaxImageSidePx ||
      height_px > io::kMaxImageSidePx) {
    throw UsageError(fmt::format("{}: expected a size of 1 to {} pixels a side, found {}x{}", what,
                                 io::kMaxImageSidePx, width_px, height_px));
  }
  if (!k.allFinite() || k(0, 1) != 0 || k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0 ||
      k(2, 2) != 1 || !(k(0, 0) > 0) || !(k(1, 1) > 0)) {
    throw UsageError(fmt::format(
        "{}: `K`: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels, finite and with fx and "
        "fy above 0; undistort images that need more",
        what));
  }
  return PinholeCamera(width_px, height_px, k(0, 0), k(1, 1), k(0, 2), k(1, 2));
}

Pose PoseFrom(const Eigen::Matrix4d& cam_from_world, const std::string& what) {
  Pose pose;
  try {
    pose = io::PoseFromMatrix(cam_from_world, io::kRotationTolerance, what + ": `cam_from_world`");
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
  const double away = pose.translation.cwiseAbs().maxCoeff();
  if (away <= kMaxLength) return pose;
  throw UsageError(
      fmt::format("{}: `cam_from_world`: expected a camera within {:g} units of the origin, found "
                  "{:.3g}; use another unit or origin",
                  what, kMaxLength, away));
}

}  // namespace dtr::python
