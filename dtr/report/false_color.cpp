#include "dtr/report/false_color.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace dtr::report {
namespace {

constexpr double kDarkest = 12, kBrightest = 96;  // L*: neither end is lost on a screen
constexpr int kSteps = 1024;                      // of the precomputed palette

/// 8-bit sRGB of a CIELAB colour (D65), clipped to the gamut. IEC 61966-2-1, CIE 15:2004.
std::array<std::uint8_t, 3> SrgbFromLab(double lightness, double a, double b) {
  const double fy = (lightness + 16) / 116, fx = fy + a / 500, fz = fy - b / 200;
  const auto cube = [](double f) {
    constexpr double kDelta = 6.0 / 29;
    return f > kDelta ? f * f * f : 3 * kDelta * kDelta * (f - 4.0 / 29);
  };
  const double x = 0.95047 * cube(fx), y = cube(fy), z = 1.08883 * cube(fz);
  const double linear[3] = {3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
                            -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
                            0.0556434 * x - 0.2040259 * y + 1.0572252 * z};
  std::array<std::uint8_t, 3> rgb{};
  for (size_t i = 0; i < 3; ++i) {
    const double v = std::clamp(linear[i], 0.0, 1.0);
    const double coded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
    rgb[i] = static_cast<std::uint8_t>(std::lround(255 * coded));
  }
  return rgb;
}

using Table = std::array<std::array<std::uint8_t, 3>, kSteps>;

Table MakeTable(Palette palette) {
  Table table;
  for (int i = 0; i < kSteps; ++i) {
    const double value = static_cast<double>(i) / (kSteps - 1);
    const double lightness = kDarkest + (kBrightest - kDarkest) * value;
    // Hue turns from blue over violet and red to yellow; chroma is largest where the gamut is.
    const double hue = (290 + 170 * value) * std::numbers::pi / 180;
    const double chroma =
        palette == Palette::kGrey ? 0 : 30 + 45 * std::sin(std::numbers::pi * std::pow(value, 0.8));
    table[static_cast<size_t>(i)] =
        SrgbFromLab(lightness, chroma * std::cos(hue), chroma * std::sin(hue));
  }
  return table;
}

const Table& TableOf(Palette palette) {
  static const Table kColor = MakeTable(Palette::kColor), kGrey = MakeTable(Palette::kGrey);
  return palette == Palette::kGrey ? kGrey : kColor;
}

/// Values at the 1 % and 99 % percentiles; none of no values.
std::optional<ColorScale> Percentiles(std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  const auto at = [&](double share) {
    const auto position = std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + position, values.end());
    return values[static_cast<size_t>(position)];
  };
  const double low = at(0.01), high = at(0.99);
  return ColorScale{low, high};
}

/// Scale of inverse depth.
std::optional<ColorScale> InverseScale(const DepthImage& depth, const DepthColors& colors) {
  std::vector<double> inverse;
  inverse.reserve(depth.grid().data().size());
  for (const float value : depth.grid().data()) {
    if (!DepthImage::IsHole(value)) inverse.push_back(1.0 / value);
  }
  auto scale = Percentiles(inverse);
  if (!scale) return scale;
  if (colors.far_z && *colors.far_z > 0) scale->dark = 1 / *colors.far_z;
  if (colors.near_z && *colors.near_z > 0) scale->bright = 1 / *colors.near_z;
  return scale;
}

bool IsUsable(float sigma) { return sigma > 0 && std::isfinite(sigma); }

std::optional<ColorScale> LogScale(const Grid<float>& sigma) {
  std::vector<double> logs;
  for (const float s : sigma.data()) {
    if (IsUsable(s)) logs.push_back(std::log(s));
  }
  return Percentiles(logs);
}

/// Paints `value(i)` on the scale; empty values are holes.
template <typename Value>
ImageRgb8 Paint(int width, int height, Palette palette, const std::optional<ColorScale>& scale,
                const Value& value) {
  ImageRgb8 image(width, height, 3);
  const Table& table = TableOf(palette);
  // A map of one value is shown bright rather than divided by zero.
  const double low = scale ? scale->dark : 0, high = scale ? scale->bright : 0;
  const double factor = high > low ? 1 / (high - low) : 0;
  for (size_t i = 0; i < static_cast<size_t>(width) * static_cast<size_t>(height); ++i) {
    const std::optional<double> v = value(i);
    auto color = kHoleColor;
    if (v) {
      const double t = factor > 0 ? std::clamp((*v - low) * factor, 0.0, 1.0) : 1.0;
      color = table[static_cast<size_t>(std::lround(t * (kSteps - 1)))];
    }
    std::copy(color.begin(), color.end(),
              image.data().begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  return image;
}

}  // namespace

std::array<std::uint8_t, 3> PaletteColor(Palette palette, double value) {
  const double t = value > 0 ? std::min(value, 1.0) : 0.0;  // NaN is dark
  return TableOf(palette)[static_cast<size_t>(std::lround(t * (kSteps - 1)))];
}

std::optional<ColorScale> ScaleOfDepth(const DepthImage& depth, const DepthColors& colors) {
  const auto inverse = InverseScale(depth, colors);
  if (!inverse) return std::nullopt;
  return ColorScale{1 / inverse->dark, 1 / inverse->bright};
}

std::optional<ColorScale> ScaleOfSigma(const Grid<float>& sigma) {
  const auto logs = LogScale(sigma);
  if (!logs) return std::nullopt;
  return ColorScale{std::exp(logs->dark), std::exp(logs->bright)};
}

ImageRgb8 ColorizeDepth(const DepthImage& depth, const DepthColors& colors) {
  if (depth.empty()) return {};
  const std::vector<float>& z = depth.grid().data();
  return Paint(depth.width(), depth.height(), colors.palette, InverseScale(depth, colors),
               [&](size_t i) -> std::optional<double> {
                 if (DepthImage::IsHole(z[i])) return std::nullopt;
                 return 1.0 / z[i];
               });
}

ImageRgb8 ColorizeSigma(const Grid<float>& sigma, Palette palette) {
  if (sigma.empty()) return {};
  return Paint(sigma.width(), sigma.height(), palette, LogScale(sigma),
               [&](size_t i) -> std::optional<double> {
                 if (!IsUsable(sigma.data()[i])) return std::nullopt;
                 return std::log(sigma.data()[i]);
               });
}

}  // namespace dtr::report
