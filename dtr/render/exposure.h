// dtr/render/exposure.h -- SPEC 4.4, 4.9: photos and rendered images in another exposure.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "dtr/render/scene.h"
#include "dtr/render/valid_views.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr {

/// Linear light in [0, 1] in another exposure: times `exposure` (above 0) in the dark, bent so that
/// white stays white, for what a photo clipped is as bright in any. Rising; exposures multiply, so
/// 1 / exposure undoes it.
inline double Exposed(double linear, double exposure) {
  if (exposure == 1) return linear;
  const auto fourth = [](double v) { return v * v * v * v; };
  return exposure * linear / std::sqrt(std::sqrt(1 + (fourth(exposure) - 1) * fourth(linear)));
}

/// The exposure per channel (Exposed) that takes `from` to `to`, linear light in (0, 1).
inline double ExposureBetween(double from, double to) {
  const auto darkness = [](double v) { return 1 / (v * v * v * v) - 1; };
  return std::sqrt(std::sqrt(darkness(from) / darkness(to)));
}

/// SPEC 4.4: from 0 to 1, how far what a view's photo clipped is no colour for an image of this
/// exposure (FrameExposure): 0 unless the image is darker than the photo.
double ClippedOf(const View& view, const Eigen::Vector3d& exposure);

/// SPEC 4.4: how far a colour is clipped, from 0 to `clipped` (ClippedOf); `greatest` of its
/// channels as they are blended, in [0, 1].
inline double ClippedShare(double clipped, double greatest, bool linear_light) {
  const double square = greatest * greatest, fourth = square * square;
  return clipped * std::min(2 * (linear_light ? fourth : fourth * fourth), 1.0);
}

/// SPEC 4.4: the darker of two colours of one surface has this share of every channel of the other.
inline constexpr double kSameSurface = 0.75, kSameSurfaceInLinearLight = 0.5;

/// SPEC 4.9. The exposure per channel of an image from `novel_from_world`, that of its nearest
/// views, against the set's mean, in which the views are blended. All are exactly 1 where no view
/// has a gain.
Eigen::Vector3d FrameExposure(const RenderScene& scene, const ViewSelection& selection,
                              const Pose& novel_from_world);

/// What an exposure makes of each value of an 8-bit sRGB image.
class ExposureCurve {
 public:
  explicit ExposureCurve(const Eigen::Vector3d& exposure);
  void Apply(ImageRgb8& image) const;
  /// Pixels of 4 bytes: R, G, B and one that stays.
  void Apply(std::span<std::uint32_t> rgba) const;

 private:
  std::array<std::array<std::uint8_t, 256>, 3> values_{};
};

/// Empty where the exposure changes nothing.
std::optional<ExposureCurve> CurveOf(const Eigen::Vector3d& exposure);

}  // namespace dtr
