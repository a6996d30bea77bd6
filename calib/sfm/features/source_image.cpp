#include "calib/sfm/features/source_image.h"

#include <algorithm>
#include <vector>

namespace dtr::sfm {
namespace {

float Value(std::uint8_t v) { return static_cast<float>(v) * (1.0f / 255); }
float Value(float v) { return v > 0 ? std::min(v, 1.0f) : 0.0f; }  // NaN is not above 0

/// Pixels of an axis that one of the new grid covers, the first and the last in part.
struct Cover {
  int first, last;
  float first_weight, last_weight;  ///< the others count 1; one pixel alone has first_weight

  Cover(int i, int size, int new_size) {
    const double step = static_cast<double>(size) / new_size, from = i * step, to = from + step;
    first = std::min(static_cast<int>(from), size - 1);
    last = std::clamp(static_cast<int>(to), first, size - 1);
    first_weight = static_cast<float>(first == last ? to - from : first + 1 - from);
    last_weight = first == last ? 0.0f : static_cast<float>(to - last);
  }
  float WeightOf(int i) const {
    return i == first ? first_weight : (i == last ? last_weight : 1.0f);
  }
};

template <typename T>
RowStore Shrunk(std::span<const T> grey, int width, int height, int new_width, int new_height) {
  RowStore image(new_width, new_height, new_height);
  const size_t columns = static_cast<size_t>(width);
  if (new_width == width && new_height == height) {
    for (int y = 0; y < height; ++y) {
      const T* from = grey.data() + static_cast<size_t>(y) * columns;
      std::transform(from, from + width, image.row(y), [](T v) { return Value(v); });
    }
    return image;
  }
  std::vector<Cover> covers;
  for (int x = 0; x < new_width; ++x) covers.emplace_back(x, width, new_width);
  const float area = static_cast<float>(static_cast<double>(width) / new_width *
                                        (static_cast<double>(height) / new_height));
  std::vector<float> sums(columns);
  for (int y = 0; y < new_height; ++y) {
    const Cover rows(y, height, new_height);
    std::fill(sums.begin(), sums.end(), 0.0f);
    for (int i = rows.first; i <= rows.last; ++i) {
      const T* from = grey.data() + static_cast<size_t>(i) * columns;
      const float weight = rows.WeightOf(i);
      for (size_t x = 0; x < columns; ++x) sums[x] += weight * Value(from[x]);
    }
    float* out = image.row(y);
    for (int x = 0; x < new_width; ++x) {
      const Cover& c = covers[static_cast<size_t>(x)];
      float sum = c.first_weight * sums[static_cast<size_t>(c.first)] +
                  c.last_weight * sums[static_cast<size_t>(c.last)];
      for (int i = c.first + 1; i < c.last; ++i) sum += sums[static_cast<size_t>(i)];
      out[x] = sum / area;
    }
  }
  return image;
}

}  // namespace

RowStore SourceImage(std::span<const std::uint8_t> grey, int width, int height, int new_width,
                     int new_height) {
  return Shrunk(grey, width, height, new_width, new_height);
}

RowStore SourceImage(std::span<const float> grey, int width, int height, int new_width,
                     int new_height) {
  return Shrunk(grey, width, height, new_width, new_height);
}

}  // namespace dtr::sfm
