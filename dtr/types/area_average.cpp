#include "dtr/types/area_average.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace dtr {
namespace {

void CheckSizes(const Grid<std::uint8_t>& image, int new_width_px, int new_height_px) {
  if (new_width_px <= 0 || new_height_px <= 0 || new_width_px > image.width() ||
      new_height_px > image.height()) {
    throw std::invalid_argument("AreaAverage: expected a size from 1x1 to " +
                                std::to_string(image.width()) + "x" +
                                std::to_string(image.height()) + ", found " +
                                std::to_string(new_width_px) + "x" + std::to_string(new_height_px));
  }
}

// Old pixels [first, first + weights.size()) that one new pixel covers along an axis. In units of
// 1/new_size of an old pixel everything is an integer: the new pixel i is [i * old_size,
// (i + 1) * old_size), the old pixel j is [j * new_size, (j + 1) * new_size), and a weight is the
// length of their overlap. The weights sum to old_size.
struct Cover {
  int first = 0;
  std::vector<std::uint32_t> weights;
};

std::vector<Cover> CoversAlongAxis(int old_size, int new_size) {
  std::vector<Cover> covers(static_cast<size_t>(new_size));
  const auto n = static_cast<std::int64_t>(new_size);
  for (std::int64_t i = 0; i < n; ++i) {
    const std::int64_t begin = i * old_size, end = begin + old_size;
    Cover& cover = covers[static_cast<size_t>(i)];
    cover.first = static_cast<int>(begin / n);
    for (std::int64_t j = cover.first; j * n < end; ++j) {
      cover.weights.push_back(
          static_cast<std::uint32_t>(std::min(end, (j + 1) * n) - std::max(begin, j * n)));
    }
  }
  return covers;
}

}  // namespace

std::pair<int, int> TargetSize(int width_px, int height_px, int max_size_px) {
  if (width_px <= 0 || height_px <= 0 || max_size_px < 0) {
    throw std::invalid_argument("TargetSize: sizes must be positive and the limit not negative");
  }
  const int longest = std::max(width_px, height_px);
  if (max_size_px == 0 || longest <= max_size_px) return {width_px, height_px};
  const auto scaled = [&](int side) {
    const std::int64_t twice = 2 * static_cast<std::int64_t>(side) * max_size_px;
    return std::max(1,
                    static_cast<int>((twice + longest) / (2 * static_cast<std::int64_t>(longest))));
  };
  return {scaled(width_px), scaled(height_px)};
}

Grid<std::uint8_t> AreaAverage(const Grid<std::uint8_t>& image, int new_width_px,
                               int new_height_px) {
  CheckSizes(image, new_width_px, new_height_px);
  const int channels = image.channels();
  const auto columns = CoversAlongAxis(image.width(), new_width_px);
  const auto rows = CoversAlongAxis(image.height(), new_height_px);
  const std::uint64_t area =
      static_cast<std::uint64_t>(image.width()) * static_cast<std::uint64_t>(image.height());
  Grid<std::uint8_t> smaller(new_width_px, new_height_px, channels);
  const size_t row_values = static_cast<size_t>(image.width()) * static_cast<size_t>(channels);
  // At most 255 * height: 32 bits hold it up to 16 million rows.
  std::vector<std::uint32_t> sums(row_values);
  for (int y = 0; y < new_height_px; ++y) {
    std::fill(sums.begin(), sums.end(), 0u);
    const Cover& row = rows[static_cast<size_t>(y)];
    for (size_t j = 0; j < row.weights.size(); ++j) {
      const std::uint8_t* values = image.row(row.first + static_cast<int>(j));
      const std::uint32_t weight = row.weights[j];
      for (size_t i = 0; i < row_values; ++i) sums[i] += weight * values[i];
    }
    std::uint8_t* out = smaller.row(y);
    for (const Cover& column : columns) {
      for (int c = 0; c < channels; ++c) {
        std::uint64_t sum = 0;
        size_t i = static_cast<size_t>(column.first) * static_cast<size_t>(channels) +
                   static_cast<size_t>(c);
        for (const std::uint32_t weight : column.weights) {
          sum += static_cast<std::uint64_t>(weight) * sums[i];
          i += static_cast<size_t>(channels);
        }
        *out++ = static_cast<std::uint8_t>((2 * sum + area) / (2 * area));
      }
    }
  }
  return smaller;
}

Mask ShrinkMask(const Mask& mask, int new_width_px, int new_height_px) {
  CheckSizes(mask, new_width_px, new_height_px);
  const auto columns = CoversAlongAxis(mask.width(), new_width_px);
  const auto rows = CoversAlongAxis(mask.height(), new_height_px);
  Mask smaller(new_width_px, new_height_px, 1, 255);
  for (int y = 0; y < new_height_px; ++y) {
    const Cover& row = rows[static_cast<size_t>(y)];
    for (size_t j = 0; j < row.weights.size(); ++j) {
      const std::uint8_t* usable = mask.row(row.first + static_cast<int>(j));
      for (int x = 0; x < new_width_px; ++x) {
        const Cover& column = columns[static_cast<size_t>(x)];
        const std::uint8_t* begin = usable + column.first;
        if (std::any_of(begin, begin + column.weights.size(), [](auto m) { return m == 0; })) {
          smaller(x, y) = 0;
        }
      }
    }
  }
  return smaller;
}

}  // namespace dtr
