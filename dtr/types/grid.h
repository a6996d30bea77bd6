// dtr/types/grid.h -- a plain two-dimensional array.
#pragma once
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace dtr {

/// Values on an image grid, shape (height, width, channels), row-major, top row first, channels
/// interleaved.
template <typename T>
class Grid {
 public:
  Grid() = default;
  /// Throws std::invalid_argument unless all three are positive.
  Grid(int width_px, int height_px, int channels = 1, T value = T{})
      : width_(width_px), height_(height_px), channels_(channels) {
    if (width_px <= 0 || height_px <= 0 || channels <= 0) {
      throw std::invalid_argument("Grid: width, height and channels must be positive");
    }
    data_.assign(static_cast<size_t>(width_px) * static_cast<size_t>(height_px) *
                     static_cast<size_t>(channels),
                 value);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return data_.empty(); }
  bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  /// Unchecked: requires Contains(x, y).
  T& operator()(int x, int y, int channel = 0) { return data_[Index(x, y, channel)]; }
  const T& operator()(int x, int y, int channel = 0) const { return data_[Index(x, y, channel)]; }

  T* row(int y) { return data_.data() + Index(0, y, 0); }
  const T* row(int y) const { return data_.data() + Index(0, y, 0); }
  std::vector<T>& data() { return data_; }
  const std::vector<T>& data() const { return data_; }

  bool operator==(const Grid&) const = default;

 private:
  size_t Index(int x, int y, int channel) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)) *
               static_cast<size_t>(channels_) +
           static_cast<size_t>(channel);
  }

  int width_ = 0, height_ = 0, channels_ = 1;
  std::vector<T> data_;
};

/// A photo or rendering: 8-bit sRGB, 3 channels (R, G, B).
using ImageRgb8 = Grid<std::uint8_t>;
/// 255 where a pixel is usable, 0 where it has no source or was masked out by the user.
using Mask = Grid<std::uint8_t>;

}  // namespace dtr
