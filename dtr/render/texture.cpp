#include "dtr/render/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/render/colour.h"

namespace dtr {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

bool Usable(const View& view, int x, int y) { return view.mask.empty() || view.mask(x, y) != 0; }

/// The pixel times the view's gain.
Rgb Corrected(const View& view, int x, int y) {
  const std::uint8_t* photo = &view.image(x, y);
  Rgb rgb{photo[0], photo[1], photo[2]};
  for (size_t c = 0; c < 3; ++c) {
    const double gain = view.gain[static_cast<Eigen::Index>(c)];
    if (gain != 1) rgb[c] = Srgb8FromLinear(gain * LinearFromSrgb8()[rgb[c]]);
  }
  return rgb;
}

/// What stands in for a masked pixel.
Rgb MeanOfNeighbours(const View& view, int x, int y) {
  std::array<int, 3> sum{};
  int count = 0;
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, view.image.height() - 1); ++j) {
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, view.image.width() - 1); ++i) {
      if (!Usable(view, i, j)) continue;
      const Rgb rgb = Corrected(view, i, j);
      for (size_t c = 0; c < 3; ++c) sum[c] += rgb[c];
      ++count;
    }
  }
  Rgb mean{};
  if (count == 0) return mean;
  for (size_t c = 0; c < 3; ++c) {
    mean[c] = static_cast<std::uint8_t>((2 * sum[c] + count) / (2 * count));
  }
  return mean;
}

Rgb Sample(const View& view, int x, int y) {
  return Usable(view, x, y) ? Corrected(view, x, y) : MeanOfNeighbours(view, x, y);
}

}  // namespace

std::vector<std::uint8_t> SampledImage(const View& view) {
  const int width = view.image.width();
  std::vector<std::uint8_t> rgba(view.image.data().size() / 3 * 4);
  size_t at = 0;
  for (int y = 0; y < view.image.height(); ++y) {
    for (int x = 0; x < width; ++x, at += 4) {
      const Rgb rgb = Sample(view, x, y);
      std::copy(rgb.begin(), rgb.end(), rgba.begin() + static_cast<std::ptrdiff_t>(at));
      rgba[at + 3] = Usable(view, x, y) ? 255 : 0;
    }
  }
  return rgba;
}

std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel,
                                        bool linear_light) {
  const ImageRgb8& image = view.image;
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const double x = std::clamp(pixel.x() - 0.5, 0.0, image.width() - 1.0);
  const double y = std::clamp(pixel.y() - 0.5, 0.0, image.height() - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width() - 1), y1 = std::min(y0 + 1, image.height() - 1);
  const double fx = x - x0, fy = y - y0;
  const double weights[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  const int columns[4] = {x0, x1, x0, x1}, rows[4] = {y0, y0, y1, y1};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  bool usable = false;
  for (size_t tap = 0; tap < 4; ++tap) {
    if (!(weights[tap] > 0)) continue;
    usable = usable || Usable(view, columns[tap], rows[tap]);
    const Rgb rgb = Sample(view, columns[tap], rows[tap]);
    for (size_t c = 0; c < 3; ++c) {
      sum[static_cast<Eigen::Index>(c)] +=
          weights[tap] * (linear_light ? linear[rgb[c]] : rgb[c] / 255.0);
    }
  }
  if (!usable) return std::nullopt;
  return sum;
}

}  // namespace dtr
