#include "dtr/report/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace dtr::report {
namespace {

constexpr int kGapPx = 4;
constexpr std::uint8_t kGround = 24;

/// Shares of source pixels in each target pixel along one axis.
struct Span {
  int begin = 0;
  std::vector<double> weights;
};

std::vector<Span> AreaWeights(int from, int to) {
  std::vector<Span> spans(static_cast<size_t>(to));
  const double ratio = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const double low = i * ratio, high = std::min<double>(from, (i + 1) * ratio);
    Span& span = spans[static_cast<size_t>(i)];
    span.begin = std::min(static_cast<int>(low), from - 1);
    const int end = std::clamp(static_cast<int>(std::ceil(high)), span.begin + 1, from);
    double sum = 0;
    for (int k = span.begin; k < end; ++k) {
      span.weights.push_back(std::min<double>(high, k + 1) - std::max<double>(low, k));
      sum += span.weights.back();
    }
    for (double& w : span.weights) w /= sum;
  }
  return spans;
}

}  // namespace

ImageRgb8 Shrink(const ImageRgb8& image, int max_side_px) {
  if (max_side_px <= 0) throw std::invalid_argument("Shrink: the size must be positive");
  const int side = std::max(image.width(), image.height());
  if (image.empty() || side <= max_side_px) return image;
  const auto scaled = [&](int size) {
    return std::max(1,
                    static_cast<int>(std::lround(static_cast<double>(size) * max_side_px / side)));
  };
  const int width = scaled(image.width()), height = scaled(image.height());
  const int channels = image.channels();
  const std::vector<Span> across = AreaWeights(image.width(), width),
                          down = AreaWeights(image.height(), height);
  ImageRgb8 small(width, height, channels);
  for (int y = 0; y < height; ++y) {
    const Span& rows = down[static_cast<size_t>(y)];
    for (int x = 0; x < width; ++x) {
      const Span& columns = across[static_cast<size_t>(x)];
      for (int c = 0; c < channels; ++c) {
        double sum = 0;
        for (size_t v = 0; v < rows.weights.size(); ++v) {
          double row = 0;
          for (size_t u = 0; u < columns.weights.size(); ++u) {
            row += columns.weights[u] *
                   image(columns.begin + static_cast<int>(u), rows.begin + static_cast<int>(v), c);
          }
          sum += rows.weights[v] * row;
        }
        small(x, y, c) = static_cast<std::uint8_t>(std::lround(std::clamp(sum, 0.0, 255.0)));
      }
    }
  }
  return small;
}

ImageRgb8 ContactSheet(std::span<const ImageRgb8> images, int columns, int cell_px) {
  if (columns <= 0 || cell_px <= 0) {
    throw std::invalid_argument("ContactSheet: columns and cells must be positive");
  }
  if (images.empty()) return {};
  const int count = static_cast<int>(images.size());
  const int used_columns = std::min(columns, count), rows = (count + columns - 1) / columns;
  const int stride = cell_px + kGapPx;
  ImageRgb8 sheet(used_columns * stride + kGapPx, rows * stride + kGapPx, 3, kGround);
  for (int i = 0; i < count; ++i) {
    const ImageRgb8 small = Shrink(images[static_cast<size_t>(i)], cell_px);
    if (small.empty()) continue;
    const int left = kGapPx + (i % columns) * stride + (cell_px - small.width()) / 2;
    const int top = kGapPx + (i / columns) * stride + (cell_px - small.height()) / 2;
    for (int y = 0; y < small.height(); ++y) {
      for (int x = 0; x < small.width(); ++x) {
        for (int c = 0; c < 3; ++c) {
          sheet(left + x, top + y, c) = small(x, y, std::min(c, small.channels() - 1));
        }
      }
    }
  }
  return sheet;
}

}  // namespace dtr::report
