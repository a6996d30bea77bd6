#include "calib/sfm/mapping/adjust_map.h"

#include <algorithm>
#include <cmath>

#include "calib/bundle/plain/plain_adjust.h"
#include "dtr/base/error.h"

namespace dtr::sfm {
namespace {

bool IsSound(const calib::Bundle& bundle) {
  const auto lens_is = [](const calib::LensCamera& lens) {
    return lens.params[0] > 0 && std::all_of(lens.params.begin(), lens.params.end(),
                                             [](double x) { return std::isfinite(x); });
  };
  const auto pose_is = [](const calib::BundleImage& image) {
    return image.cam_from_world.rotation.coeffs().allFinite() &&
           image.cam_from_world.translation.allFinite();
  };
  return std::all_of(bundle.lenses.begin(), bundle.lenses.end(), lens_is) &&
         std::all_of(bundle.images.begin(), bundle.images.end(), pose_is) &&
         std::all_of(bundle.points.begin(), bundle.points.end(),
                     [](const Eigen::Vector4d& p) { return p.allFinite(); });
}

}  // namespace

bool CanAdjust(const calib::LensCamera& lens) { return calib::IsPlain(lens); }

bool AdjustMap(const AdjustMapOptions& options, calib::Bundle* bundle) {
  calib::PlainOptions plain;
  for (const MapLens lens : options.lenses) {
    plain.fixed_lenses.push_back(lens == MapLens::kFixed);
  }
  constexpr double kKnownFocalShare =
      0.04;  // EXIF gives whole millimetres of some 28, nominal ones
  constexpr double kNoiseOfScale = 1.0 / 3;
  plain.free_focal = !options.focals_hold;
  plain.known_focals_px = options.known_focals_px;
  plain.focal_sigma_share = kKnownFocalShare / (kNoiseOfScale * options.cauchy_px);
  plain.cauchy_px = options.cauchy_px;
  plain.cost_tolerance = options.cost_tolerance;
  plain.max_iterations = options.iterations;
  plain.progress = options.progress;
  calib::Bundle moved = *bundle;
  try {
    calib::AdjustPlain(plain, {}, moved);
  } catch (const Interrupted&) {
    throw;
  } catch (const Error&) {
    return false;  // too few images or observations, all of which the mapper itself can cause
  }
  if (!IsSound(moved)) return false;
  *bundle = std::move(moved);
  return true;
}

}  // namespace dtr::sfm
