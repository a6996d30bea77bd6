#include "capture/layout_looks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>

#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "dtr/types/area_average.h"
#include "dtr/types/luma.h"

namespace dtr::capture {
namespace {

constexpr int kLookSidePx = 24;
constexpr size_t kSamples = 100'000;
constexpr int kNear = 8;  // levels that JPEG moves flat values by
constexpr size_t kFewColours = 64;
constexpr double kSomePixels = 0.001;  // share; hot pixels and reflections are fewer

// How the sampled pixels compare with those to the right and below.
struct Neighbours {
  size_t pairs = 0, equal = 0, single_step = 0;  // of those that are not both 0 or both 255

  void Add(const std::uint8_t* a, const std::uint8_t* b) {
    int step = 0;
    bool clipped = true;
    for (int c = 0; c < 3; ++c) {
      step = std::max(step, std::abs(a[c] - b[c]));
      clipped = clipped && a[c] == a[0] && b[c] == a[0] && (a[0] == 0 || a[0] == 255);
    }
    if (clipped) return;
    ++pairs;
    equal += step == 0;
    single_step += step == 1;
  }
};

Neighbours NeighboursIn(const ImageRgb8& image, size_t step) {
  Neighbours neighbours;
  const auto width = static_cast<size_t>(image.width());
  const size_t pixels = image.data().size() / 3;
  for (size_t i = 0; i < pixels; i += step) {
    const std::uint8_t* rgb = &image.data()[3 * i];
    if ((i + 1) % width != 0) neighbours.Add(rgb, rgb + 3);
    if (i + width < pixels) neighbours.Add(rgb, rgb + 3 * width);
  }
  return neighbours;
}

ImageLook LookAtPixels(const ImageRgb8& image) {
  ImageLook look;
  look.readable = true;
  const size_t pixels = image.data().size() / 3;
  const size_t step = std::max<size_t>(1, pixels / kSamples);
  size_t samples = 0, grey = 0, extreme = 0, tiny = 0, coloured = 0, unit = 0;
  size_t black = 0, white = 0;
  std::set<int> colours;
  for (size_t i = 0; i < pixels; i += step) {
    const std::uint8_t* rgb = &image.data()[3 * i];
    const auto [low, high] = std::minmax({rgb[0], rgb[1], rgb[2]});
    ++samples;
    grey += high - low <= kNear;
    extreme += high <= kNear || low >= 255 - kNear;
    tiny += high <= 1;
    black += high == 0;
    white += low == 255;
    if (colours.size() <= kFewColours) colours.insert(rgb[0] << 16 | rgb[1] << 8 | rgb[2]);
    if (high - low <= kNear) continue;
    ++coloured;
    double square = 0;
    for (int c = 0; c < 3; ++c) square += std::pow(2 * rgb[c] / 255.0 - 1, 2);
    unit += std::abs(std::sqrt(square) - 1) < 0.1;
  }
  const auto share = [](size_t part, size_t all) {
    return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
  };
  look.grey = share(grey, samples) > 0.99;
  look.binary = look.grey && (share(extreme, samples) > 0.98 || tiny == samples);
  look.normals = share(coloured, samples) > 0.02 && share(unit, coloured) > 0.8;
  look.two_ends = share(black, samples) > kSomePixels && share(white, samples) > kSomePixels;
  // Noise and shading step by one level from pixel to pixel, labels by any number.
  constexpr double kFlatPhoto = 0.5, kFlatLabels = 0.9;
  const Neighbours near = NeighboursIn(image, step);
  look.few_colours = colours.size() <= kFewColours;
  look.flat = near.pairs == 0 || share(near.equal, near.pairs) > kFlatPhoto;
  look.labels = look.few_colours && share(near.equal, near.pairs) > kFlatLabels &&
                2 * near.single_step <= near.pairs - near.equal;
  const int width = std::min(kLookSidePx, image.width());
  const int height = std::min(kLookSidePx, image.height());
  const ImageRgb8 small = AreaAverage(image, width, height);
  look.thumbnail = Grid<std::uint8_t>(width, height);
  for (size_t i = 0; i < look.thumbnail.data().size(); ++i) {
    look.thumbnail.data()[i] = static_cast<std::uint8_t>(Luma(&small.data()[3 * i]) / 256);
  }
  return look;
}

}  // namespace

const ImageSize& Looks::SizeOf(const std::string& name) {
  const auto [entry, is_new] = sizes_.try_emplace(name);
  if (!is_new) return entry->second;
  try {
    const io::ImageHeader header = io::ReadImageHeader(folder_ / name, memory_gb_);
    const bool sideways = header.exif_orientation >= 5;
    entry->second = {sideways ? header.height_px : header.width_px,
                     sideways ? header.width_px : header.height_px,
                     header.channels == 1,
                     header.is_float || header.bits > 8,
                     header.is_float,
                     header.format == "jpeg"};
  } catch (const Error&) {
    // Whoever reads it as a photo says why.
  }
  return entry->second;
}

const ImageLook& Looks::LookOf(const std::string& name) {
  const auto [entry, is_new] = looks_.try_emplace(name);
  if (!is_new) return entry->second;
  try {
    entry->second = LookAtPixels(
        io::ReadImage(folder_ / name, {.apply_exif_orientation = true, .memory_gb = memory_gb_}));
  } catch (const Error&) {
    // As above.
  }
  return entry->second;
}

ImageKind Looks::KindOf(const std::vector<std::string>& samples, bool called_masks) {
  size_t readable = 0, binary = 0, two_ends = 0, normals = 0, labels = 0;
  for (const std::string& sample : samples) {
    if (SizeOf(sample).width_px == 0) continue;
    if (SizeOf(sample).jpeg) return ImageKind::kPhoto;
    const ImageLook& look = LookOf(sample);
    if (!look.readable) continue;
    ++readable;
    binary += look.binary;
    two_ends += look.binary && look.two_ends;
    normals += look.normals;
    labels += look.labels;
  }
  if (readable == 0) return ImageKind::kPhoto;
  if (binary == readable && (two_ends > 0 || called_masks)) return ImageKind::kMask;
  if (normals == readable) return ImageKind::kNormals;
  return labels == readable ? ImageKind::kLabels : ImageKind::kPhoto;
}

bool Looks::IsReducedSize(const std::string& smaller, const std::string& larger) {
  const ImageSize small = SizeOf(smaller), large = SizeOf(larger);
  constexpr double kMinFactor = 1.2, kRoundingPx = 1;
  if (small.width_px == 0 || large.width_px == 0) return false;
  const double factor =
      static_cast<double>(large.width_px + large.height_px) / (small.width_px + small.height_px);
  return factor >= kMinFactor &&
         std::abs(large.width_px / factor - small.width_px) <= kRoundingPx &&
         std::abs(large.height_px / factor - small.height_px) <= kRoundingPx;
}

double Looks::Difference(const std::string& a, const std::string& b) {
  Grid<std::uint8_t> x = LookOf(a).thumbnail, y = LookOf(b).thumbnail;
  if (x.empty() || y.empty()) return std::numeric_limits<double>::infinity();
  const int width = std::min(x.width(), y.width()), height = std::min(x.height(), y.height());
  x = AreaAverage(x, width, height);
  y = AreaAverage(y, width, height);
  double sum = 0, squares = 0, apart = 0;
  for (size_t i = 0; i < x.data().size(); ++i) {
    sum += x.data()[i];
    squares += x.data()[i] * x.data()[i];
    apart += std::pow(x.data()[i] - y.data()[i], 2);
  }
  const auto count = static_cast<double>(x.data().size());
  const double variance = squares / count - std::pow(sum / count, 2);
  // A level of rounding is no difference in an image of one colour.
  return std::sqrt(apart / count) / std::sqrt(std::max(variance, 16.0));
}

}  // namespace dtr::capture
