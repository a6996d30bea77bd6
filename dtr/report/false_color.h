// dtr/report/false_color.h -- depth as images. Closer is brighter.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"

namespace dtr::report {

enum class Palette {
  kColor,  ///< dark blue, violet, red, orange, pale yellow; lightness rises evenly
  kGrey,   ///< dark to light grey
};

/// What holes look like: a quiet green that no palette contains.
inline constexpr std::array<std::uint8_t, 3> kHoleColor{16, 104, 80};

struct DepthColors {
  Palette palette = Palette::kColor;
  /// Depths shown darkest and brightest, scene units; by default the 99 % and 1 % percentiles of
  /// the map. Beyond them, colours stay at the ends.
  std::optional<double> far_z, near_z;
};

/// Colour of a value in [0, 1] (clamped), 0 dark, 1 bright: lightness L* runs linearly from 12 to
/// 96 in CIELAB, so equal steps look equal (CIE 15:2004); 8-bit sRGB.
std::array<std::uint8_t, 3> PaletteColor(Palette palette, double value);

/// Values at the ends of a palette; beyond them colours stay the same.
struct ColorScale {
  double dark = 0, bright = 0;
};
/// Depths, scene units, that ColorizeDepth shows darkest and brightest; none of holes alone.
std::optional<ColorScale> ScaleOfDepth(const DepthImage& depth, const DepthColors& colors = {});
/// The same of ColorizeSigma.
std::optional<ColorScale> ScaleOfSigma(const Grid<float>& sigma);

/// Depth in false colour, linear in inverse depth as disparity is.
ImageRgb8 ColorizeDepth(const DepthImage& depth, const DepthColors& colors = {});

/// Standard deviations (any positive quantity) on a logarithmic scale between the 1 % and 99 %
/// percentiles: dark is certain, bright is not. Values that are not positive are shown as holes.
ImageRgb8 ColorizeSigma(const Grid<float>& sigma, Palette palette = Palette::kColor);

}  // namespace dtr::report
