// dtr/render/texture.h -- SPEC 4.4: the colour a view shows at a point.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// The four pixel centres around a position (pixels, centre of the first at 0.5), clamped at the
/// image's border, and their bilinear weights.
struct BilinearTaps {
  int columns[4], rows[4];
  double weights[4];
  BilinearTaps(int width, int height, const Eigen::Vector2d& pixel) {
    const double x = std::clamp(pixel.x() - 0.5, 0.0, width - 1.0);
    const double y = std::clamp(pixel.y() - 0.5, 0.0, height - 1.0);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const double fx = x - x0, fy = y - y0;
    for (int tap = 0; tap < 4; ++tap) {
      const bool right = (tap & 1) != 0, below = tap >= 2;
      columns[tap] = right ? std::min(x0 + 1, width - 1) : x0;
      rows[tap] = below ? std::min(y0 + 1, height - 1) : y0;
      weights[tap] = (right ? fx : 1 - fx) * (below ? fy : 1 - fy);
    }
  }
};

/// SPEC 4.8: what a view keeps of its weight at each pixel of its image, of 255. All but near the
/// photo's rim and masked pixels; never 0 but at masked pixels.
Grid<std::uint8_t> RimFactors(const View& view);

/// The same at image position `pixel`, at most 1: bilinear, clamped at the border.
double RimFactorAt(const Grid<std::uint8_t>& factors, const Eigen::Vector2d& pixel);

/// SPEC 4.8: fading borders are at most this many times as wide as CornersMovedPx.
inline constexpr double kFadePerMoved = 4;

/// SPEC 4.8: how a view's rim factors become those of one image.
struct Fading {
  double gain = 1, offset = 0;
  double Of(double rim_factor) const { return std::min(1.0, gain * rim_factor + offset); }
};

/// Of an image that is so far from the view's own (CornersMovedPx).
Fading FadingOf(const View& view, double moved_px);

/// The view's image as renderers sample it, RGBA, row by row: the photo exposed by the
/// view's gain (Exposed, rounded to 8 bits of sRGB) with RimFactors as alpha. A masked pixel
/// has the mean of the usable ones among its 8 neighbours, black where there is none.
std::vector<std::uint8_t> SampledImage(const View& view);

/// Linear light of each 8-bit value of a channel of the photo, exposed and rounded as in
/// SampledImage.
std::array<double, 256> LinearAfterGain(const View& view, int channel);

/// The colour at image position `pixel` (pixels, centre of the first at 0.5): bilinear between the
/// four nearest pixel centres of SampledImage, clamped at the border, in sRGB values or, when
/// `linear_light`, in linear light, both in [0, 1]. Empty where all four are masked.
std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel,
                                        bool linear_light);

}  // namespace dtr
