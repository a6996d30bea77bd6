#include "calib/scaled_lens.h"

namespace dtr::calib {

LensCamera ScaledTo(LensCamera camera, int width_px, int height_px) {
  const double sx = static_cast<double>(width_px) / camera.width_px;
  const double sy = static_cast<double>(height_px) / camera.height_px;
  if (sx != sy) camera = WithTwoFocalLengths(std::move(camera));
  camera.width_px = width_px;
  camera.height_px = height_px;
  const auto focal_lengths = static_cast<size_t>(FocalCount(camera.model));
  camera.params[0] *= sx;
  if (focal_lengths == 2) camera.params[1] *= sy;
  camera.params[focal_lengths] *= sx;
  camera.params[focal_lengths + 1] *= sy;
  const bool has_skew =
      camera.model == CameraModel::kBrownAffine || camera.model == CameraModel::kFisheyeAffine;
  if (has_skew) camera.params.back() *= sx;
  return camera;
}

}  // namespace dtr::calib
