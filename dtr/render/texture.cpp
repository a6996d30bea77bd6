#include "dtr/render/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

bool Usable(const View& view, int x, int y) { return view.mask.empty() || view.mask(x, y) != 0; }

/// The pixel in the exposure of the set's mean.
Rgb Corrected(const View& view, int x, int y) {
  const std::uint8_t* photo = &view.image(x, y);
  Rgb rgb{photo[0], photo[1], photo[2]};
  for (size_t c = 0; c < 3; ++c) {
    const double gain = view.gain[static_cast<Eigen::Index>(c)];
    if (gain != 1) rgb[c] = Srgb8FromLinear(Exposed(LinearFromSrgb8()[rgb[c]], gain));
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

// SPEC 4.8: the rim's width is this share of the image's longer side, in whole pixels, at least:
constexpr double kTextureRimShare = 1.0 / 48;
constexpr int kMinRimPx = 8;

int RimWidth(const View& view) {
  const int side = std::max(view.camera.width_px(), view.camera.height_px());
  return std::max(kMinRimPx, static_cast<int>(kTextureRimShare * side));
}

/// Chessboard distance to the nearest pixel that is masked or off the image, at most `most`.
/// Rosenfeld & Pfaltz 1966: two passes, each over the half of the neighbours that it has met.
Grid<int> DistanceToUnusable(const View& view, int most) {
  const int width = view.image.width(), height = view.image.height();
  Grid<int> distance(width, height);
  const auto at = [&](int x, int y) { return distance.Contains(x, y) ? distance(x, y) : 0; };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int least = std::min({at(x - 1, y), at(x - 1, y - 1), at(x, y - 1), at(x + 1, y - 1)});
      distance(x, y) = Usable(view, x, y) ? std::min(least + 1, most) : 0;
    }
  }
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      const int least = std::min({at(x + 1, y), at(x + 1, y + 1), at(x, y + 1), at(x - 1, y + 1)});
      distance(x, y) = std::min(distance(x, y), least + 1);
    }
  }
  return distance;
}

Rgb Sample(const View& view, int x, int y) {
  return Usable(view, x, y) ? Corrected(view, x, y) : MeanOfNeighbours(view, x, y);
}

}  // namespace

Grid<std::uint8_t> RimFactors(const View& view) {
  const int width = RimWidth(view);
  const Grid<int> distance = DistanceToUnusable(view, width + 1);
  Grid<std::uint8_t> factors(view.image.width(), view.image.height());
  for (size_t p = 0; p < factors.data().size(); ++p) {
    const int steps = distance.data()[p] - 1;  // from the outermost usable pixel
    factors.data()[p] =
        steps < 0 ? 0 : static_cast<std::uint8_t>(std::max(1, (255 * steps + width / 2) / width));
  }
  return factors;
}

double RimFactorAt(const Grid<std::uint8_t>& factors, const Eigen::Vector2d& pixel) {
  const BilinearTaps taps(factors.width(), factors.height(), pixel);
  double sum = 0;
  for (size_t tap = 0; tap < 4; ++tap) {
    sum += taps.weights[tap] * factors(taps.columns[tap], taps.rows[tap]);
  }
  return std::max(sum, 1.0) / 255;
}

Fading FadingOf(const View& view, double moved_px) {
  const double width = RimWidth(view);
  const double gain = std::clamp(width / (kFadePerMoved * moved_px), 1.0, width + 1);
  return {gain, (gain - 1) / width};
}

std::vector<std::uint8_t> SampledImage(const View& view) {
  const Grid<std::uint8_t> factors = RimFactors(view);
  const int width = view.image.width();
  std::vector<std::uint8_t> rgba(view.image.data().size() / 3 * 4);
  size_t at = 0;
  for (int y = 0; y < view.image.height(); ++y) {
    for (int x = 0; x < width; ++x, at += 4) {
      const Rgb rgb = Sample(view, x, y);
      std::copy(rgb.begin(), rgb.end(), rgba.begin() + static_cast<std::ptrdiff_t>(at));
      rgba[at + 3] = factors(x, y);
    }
  }
  return rgba;
}

std::array<double, 256> LinearAfterGain(const View& view, int channel) {
  std::array<double, 256> linear = LinearFromSrgb8();
  const double gain = view.gain[channel];
  if (gain == 1) return linear;
  for (double& light : linear) light = LinearFromSrgb8()[Srgb8FromLinear(Exposed(light, gain))];
  return linear;
}

std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel,
                                        bool linear_light) {
  const ImageRgb8& image = view.image;
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const BilinearTaps taps(image.width(), image.height(), pixel);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  bool usable = false;
  for (size_t tap = 0; tap < 4; ++tap) {
    if (!(taps.weights[tap] > 0)) continue;
    usable = usable || Usable(view, taps.columns[tap], taps.rows[tap]);
    const Rgb rgb = Sample(view, taps.columns[tap], taps.rows[tap]);
    for (size_t c = 0; c < 3; ++c) {
      sum[static_cast<Eigen::Index>(c)] +=
          taps.weights[tap] * (linear_light ? linear[rgb[c]] : rgb[c] / 255.0);
    }
  }
  if (!usable) return std::nullopt;
  return sum;
}

}  // namespace dtr
