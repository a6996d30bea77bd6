#include "dtr/io/alpha.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "dtr/base/error.h"
#include "dtr/io/oiio_files.h"

namespace dtr::io {
namespace {

// OpenImageIO's convention is premultiplied alpha, except where a file is marked as straight. These
// formats have straight alpha and OpenImageIO neither marks nor converts it.
bool IsPremultiplied(const OpenedImage& in) {
  if (in.facts().Int("oiio:UnassociatedAlpha", 0) != 0) return false;
  static constexpr std::array<std::string_view, 5> kStraight{"bmp", "gif", "ico", "dds",
                                                             "jpeg2000"};
  return std::find(kStraight.begin(), kStraight.end(), in.format()) == kStraight.end();
}

// A lossy coder makes 0.01 of 0 and 0.99 of 1.
float SlackOf(const OpenedImage& in) {
  const std::string_view format = in.format();
  return format == "heif" || format == "webp" ? 0.03f : 0.0f;
}

// Means of the known pixels of blocks of 2x2, with how many of the four are known.
struct Level {
  int width = 0, height = 0;
  std::vector<std::array<float, 3>> colours;
  std::vector<char> known;
  size_t At(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

// `colour_of(x, y, rgb)` is false where the finer grid of that size knows nothing.
template <typename ColourOf>
Level Coarser(int width, int height, const ColourOf& colour_of) {
  Level level{(width + 1) / 2, (height + 1) / 2, {}, {}};
  level.colours.resize(level.At(0, level.height));
  level.known.resize(level.colours.size());
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      std::array<float, 3> sum{}, rgb{};
      float count = 0;
      for (int j = 2 * y; j < std::min(height, 2 * y + 2); ++j) {
        for (int i = 2 * x; i < std::min(width, 2 * x + 2); ++i) {
          if (!colour_of(i, j, rgb)) continue;
          for (size_t c = 0; c < 3; ++c) sum[c] += rgb[c];
          ++count;
        }
      }
      if (count == 0) continue;
      for (size_t c = 0; c < 3; ++c) level.colours[level.At(x, y)][c] = sum[c] / count;
      level.known[level.At(x, y)] = 1;
    }
  }
  return level;
}

// The colour of a coarser grid at pixel (x, y) of the finer one: bilinear between block centres.
std::array<float, 3> Interpolated(const Level& coarse, int x, int y) {
  const auto taps = [](int at, int size, std::array<int, 2>& index) {
    const int near = at / 2, other = at % 2 == 0 ? near - 1 : near + 1;
    index = {near, std::clamp(other, 0, size - 1)};
  };
  std::array<int, 2> columns{}, rows{};
  taps(x, coarse.width, columns);
  taps(y, coarse.height, rows);
  constexpr std::array<float, 2> kWeights{0.75f, 0.25f};
  std::array<float, 3> colour{};
  for (size_t j = 0; j < 2; ++j) {
    for (size_t i = 0; i < 2; ++i) {
      const auto& value = coarse.colours[coarse.At(columns[i], rows[j])];
      for (size_t c = 0; c < 3; ++c) colour[c] += kWeights[i] * kWeights[j] * value[c];
    }
  }
  return colour;
}

}  // namespace

int AlphaChannelOf(const ImageFacts& facts) {
  if (facts.alpha_channel < 0) return -1;
  if (facts.alpha_channel < facts.channels) return facts.alpha_channel;
  // OpenImageIO 2.4 names channel 4 of a GIF's four, from 0.
  return facts.channels == 2 || facts.channels == 4 ? facts.channels - 1 : -1;
}

Alpha::Alpha(OpenedImage& in, const std::filesystem::path& file) {
  const int channel = AlphaChannelOf(in.facts());
  if (channel < 0) return;
  Grid<float> values(in.facts().width, in.facts().height);
  ReadPixels(in, file, channel, channel + 1, Sample::kFloat, values.data().data());
  const float slack = SlackOf(in);
  bool opaque = true;
  for (float& value : values.data()) {
    if (std::isnan(value)) {
      throw Error(file.string() + ": its alpha channel holds NaN; export the image again");
    }
    value = std::clamp(value, 0.0f, 1.0f);
    opaque = opaque && value == 1;
    if (value <= slack) {
      ++counts_.transparent_px;
    } else if (value < 1 - slack) {
      ++counts_.partial_px;
    }
  }
  if (opaque) return;
  premultiplied_ = IsPremultiplied(in);
  values_ = std::move(values);
}

template <typename T>
void Alpha::StraightenAs(std::vector<T>& values, int channels, float most) const {
  const auto stride = static_cast<size_t>(channels);
  for (size_t i = 0; i < values_.data().size(); ++i) {
    const float alpha = values_.data()[i];
    if (alpha == 1 || (alpha > 0 && !premultiplied_)) continue;
    for (size_t c = i * stride; c < (i + 1) * stride; ++c) {
      if (alpha == 0) {
        values[c] = 0;
      } else if constexpr (std::is_integral_v<T>) {
        values[c] =
            static_cast<T>(std::lround(std::min(most, static_cast<float>(values[c]) / alpha)));
      } else {
        constexpr T kMax = std::numeric_limits<T>::max();
        values[c] = std::clamp(values[c] / alpha, -kMax, kMax);
      }
    }
  }
}

void Alpha::Straighten(std::vector<float>& values, int channels) const {
  StraightenAs(values, channels, 1.0f);
}

void Alpha::Straighten(std::vector<std::uint8_t>& values, int channels) const {
  StraightenAs(values, channels, 255.0f);
}

Mask Alpha::Usable() const {
  const auto usable = [](float alpha) { return alpha >= 0.5f; };
  if (std::all_of(values_.data().begin(), values_.data().end(), usable)) return {};
  Mask mask(values_.width(), values_.height());
  std::transform(values_.data().begin(), values_.data().end(), mask.data().begin(),
                 [&](float alpha) { return usable(alpha) ? 255 : 0; });
  return mask;
}

void AlphaTotals::Add(const AlphaCounts& photo, bool masks) {
  masked_photos += masks;
  partial_photos += photo.partial_px > 0;
  partial_px += photo.partial_px;
}

std::string AlphaTotals::Line() const {
  std::string line;
  if (masked_photos > 0) {
    line = fmt::format("alpha: transparent pixels of {} photos are masked", masked_photos);
  }
  if (partial_px > 0) {
    line += fmt::format(
        "{}{} pixels of {} photos are partly transparent: usable from an alpha of one half up",
        line.empty() ? "alpha: " : "; ", partial_px, partial_photos);
  }
  return line;
}

void FillUnusable(ImageRgb8& image, const Mask& usable) {
  const auto is_usable = [](std::uint8_t value) { return value != 0; };
  if (std::all_of(usable.data().begin(), usable.data().end(), is_usable) ||
      std::none_of(usable.data().begin(), usable.data().end(), is_usable)) {
    return;
  }
  std::vector<Level> levels;
  levels.push_back(Coarser(image.width(), image.height(), [&](int x, int y, auto& rgb) {
    for (int c = 0; c < 3; ++c) rgb[static_cast<size_t>(c)] = image(x, y, c);
    return usable(x, y) != 0;
  }));
  while (levels.back().width > 1 || levels.back().height > 1) {
    const Level& fine = levels.back();
    levels.push_back(Coarser(fine.width, fine.height, [&](int x, int y, auto& rgb) {
      rgb = fine.colours[fine.At(x, y)];
      return fine.known[fine.At(x, y)] != 0;
    }));
  }
  for (size_t k = levels.size() - 1; k-- > 0;) {
    Level& fine = levels[k];
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) {
        if (fine.known[fine.At(x, y)] != 0) continue;
        fine.colours[fine.At(x, y)] = Interpolated(levels[k + 1], x, y);
      }
    }
  }
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (usable(x, y) != 0) continue;
      const auto colour = Interpolated(levels.front(), x, y);
      for (size_t c = 0; c < 3; ++c) {
        image(x, y, static_cast<int>(c)) = static_cast<std::uint8_t>(colour[c] + 0.5f);
      }
    }
  }
}

}  // namespace dtr::io
