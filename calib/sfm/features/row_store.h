// calib/sfm/features/row_store.h -- rows of an image, all of them or the latest ones alone.
#pragma once
#include <algorithm>
#include <cstddef>

#include "dtr/base/huge_pages.h"

namespace dtr::sfm {

/// Rows of floats. With a capacity below the height, a row takes the memory of the one `capacity`
/// rows above it. Rows may be read and written up to a multiple of kRowUnit.
class RowStore {
 public:
  static constexpr int kRowUnit = 64;

  RowStore() = default;
  RowStore(int width, int height, int capacity)
      : width_(width),
        height_(height),
        capacity_(std::min(capacity, height)),
        stride_(Stride(width)),
        values_(Values(width, height, capacity)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t stride() const { return stride_; }
  bool whole() const { return capacity_ == height_; }

  /// Requires 0 <= y < height, and that the row is among the latest.
  float* row(int y) { return values_.data() + static_cast<std::size_t>(y % capacity_) * stride_; }
  const float* row(int y) const {
    return values_.data() + static_cast<std::size_t>(y % capacity_) * stride_;
  }

  /// Floats that such a store takes.
  static std::size_t Values(int width, int height, int capacity) {
    return Stride(width) * static_cast<std::size_t>(std::min(capacity, height)) + kRowUnit;
  }

 private:
  /// An odd multiple of 16: rows one below the other must not share the same sets of the cache.
  static std::size_t Stride(int width) {
    return static_cast<std::size_t>((width + kRowUnit - 1) / kRowUnit) * kRowUnit + 16;
  }

  int width_ = 0, height_ = 0, capacity_ = 1;
  std::size_t stride_ = 0;
  HugeVector<float> values_;
};

}  // namespace dtr::sfm
