#include "calib/scaled_lens.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dtr::calib {
namespace {

struct Scale {
  double x = 1, y = 1;
};

Scale ScaleTo(const LensCamera& lens, int width_px, int height_px) {
  return {static_cast<double>(width_px) / lens.width_px,
          static_cast<double>(height_px) / lens.height_px};
}

bool SameAspect(const LensCamera& lens, Scale scale) {
  const double off_px = std::min(std::abs(lens.height_px * (scale.x - scale.y)),
                                 std::abs(lens.width_px * (scale.y - scale.x)));
  return off_px < 1;  // rounded, up or down
}

LensCamera Rescaled(LensCamera lens, Scale scale, int width_px, int height_px) {
  lens.width_px = width_px;
  lens.height_px = height_px;
  const auto focals = static_cast<size_t>(FocalCount(lens.model));
  if (focals == 1) {
    lens.params[0] *= std::sqrt(scale.x * scale.y);
  } else {
    lens.params[0] *= scale.x;
    lens.params[1] *= scale.y;
  }
  lens.params[focals] *= scale.x;
  lens.params[focals + 1] *= scale.y;
  // All other terms are of the plane z = 1, but for the skew.
  const bool has_skew =
      lens.model == CameraModel::kBrownAffine || lens.model == CameraModel::kFisheyeAffine;
  if (has_skew) lens.params.back() *= scale.x;
  return lens;
}

}  // namespace

LensCamera ScaledTo(LensCamera camera, int width_px, int height_px) {
  const Scale scale = ScaleTo(camera, width_px, height_px);
  if (scale.x != scale.y) camera = WithTwoFocalLengths(std::move(camera));
  return Rescaled(std::move(camera), scale, width_px, height_px);
}

std::optional<LensCamera> ScaledLens(const LensCamera& lens, int width_px, int height_px) {
  if (lens.width_px == width_px && lens.height_px == height_px) return lens;
  const Scale scale = ScaleTo(lens, width_px, height_px);
  if (!SameAspect(lens, scale)) return std::nullopt;
  return Rescaled(lens, scale, width_px, height_px);
}

}  // namespace dtr::calib
