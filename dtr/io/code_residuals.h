// dtr/io/code_residuals.h -- 16-bit codes with holes as small numbers, for any compressor
// (docs/FORMAT.md, sections 4.1 and 4.3).
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
inline bool BitAt(const std::uint8_t* bits, int x) { return (bits[x / 8] >> (x % 8) & 1) != 0; }
inline void SetBit(std::uint8_t* bits, int x) {
  bits[x / 8] = static_cast<std::uint8_t>(bits[x / 8] | 1 << (x % 8));
}
/// Each row of bits XOR the one above it, and back. Going back throws Error where bits are set
/// beyond the end of a row.
void XorRows(std::vector<std::uint8_t>& bits, int width_px);
void XorRowsBack(std::vector<std::uint8_t>& bits, int width_px);
size_t CountBits(const std::vector<std::uint8_t>& bits);

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

/// Adds the residual of a code that is no hole.
void AddResidual(std::uint16_t code, int predicted, CodeParts& parts);

/// Takes codes back from residuals, of which `parts` has as many as are asked for.
class ResidualReader {
 public:
  explicit ResidualReader(const CodeParts& parts)
      : next_(parts.residuals.data()), wide_(parts.wide.data()) {}
  std::uint16_t Next(int predicted) {
    unsigned folded = *next_++;
    if (folded == kWide) {
      folded = wide_[0] | static_cast<unsigned>(wide_[1]) << 8;
      wide_ += 2;
    }
    const int difference = static_cast<int>(folded >> 1) ^ -static_cast<int>(folded & 1);
    const auto code = static_cast<std::uint16_t>(predicted + difference);
    hole_ |= code == 0;
    return code;
  }
  /// Throws Error where a code was 0, which no residual stands for.
  void ExpectNoHole() const;

 private:
  const std::uint8_t *next_, *wide_;
  bool hole_ = false;
};

/// Rows [first_row, first_row + rows) of the codes; code 0 is a hole.
CodeParts SplitCodes(const Grid<std::uint16_t>& codes, int first_row, int rows);

}  // namespace dtr::io
