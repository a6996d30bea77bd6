// dtr/io/code_residuals.h -- 16-bit codes with holes as small numbers, for any compressor
// (docs/FORMAT.md, section 4.1).
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr::io {

inline constexpr std::uint8_t kWide = 255;  ///< the residual's 16 bits are among the wide ones

/// What a band of rows is stored as.
struct CodeParts {
  std::vector<std::uint8_t>
      validity;  ///< a bit a pixel, rows padded to bytes, each row XOR the one above
  std::vector<std::uint8_t> residuals;  ///< a byte for each pixel that is no hole
  std::vector<std::uint8_t> wide;       ///< u16 for each residual kWide
};

/// Bytes of a row of validity bits.
inline size_t ValidityRowBytes(int width_px) { return (static_cast<size_t>(width_px) + 7) / 8; }

/// MED of JPEG-LS (Weinberger, Seroussi, Sapiro, IEEE TIP 2000, eq. 1), as the median of three.
inline int PredictedCode(int left, int above, int above_left) {
  const int low = std::min(left, above), high = std::max(left, above);
  return std::max(low, std::min(high, left + above - above_left));
}

/// The rows that predictions are made from. A hole is taken for what was predicted there, so that
/// surfaces go on behind it.
class PredictedSurface {
 public:
  explicit PredictedSurface(int width_px) : row_(static_cast<size_t>(width_px) + 1, 0) {}
  /// Start of a row: what lies beyond its left end is what lies above that.
  void BeginRow(bool first) {
    first_ = first;
    above_left_ = left_ = first ? 0 : row_[1];
  }
  int Prediction(int x) const {
    const int above = first_ ? left_ : row_[static_cast<size_t>(x) + 1];
    return first_ ? left_ : PredictedCode(left_, above, above_left_);
  }
  void Put(int x, int value) {
    int& cell = row_[static_cast<size_t>(x) + 1];
    above_left_ = cell;
    cell = left_ = value;
  }

 private:
  std::vector<int> row_;  ///< of the row above from x on, of this one before; [0] is not used
  int left_ = 0, above_left_ = 0;
  bool first_ = true;
};

/// Rows [first_row, first_row + rows) of the codes; code 0 is a hole.
CodeParts SplitCodes(const Grid<std::uint16_t>& codes, int first_row, int rows);

}  // namespace dtr::io
