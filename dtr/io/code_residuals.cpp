#include "dtr/io/code_residuals.h"

#include <bit>

#include "dtr/io/zstd_parts.h"

namespace dtr::io {
namespace {

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...; differences are taken modulo 2^16.
std::uint16_t Folded(int difference) {
  const auto d = static_cast<std::int16_t>(difference);
  return static_cast<std::uint16_t>((d << 1) ^ (d >> 15));
}

}  // namespace

void XorRows(std::vector<std::uint8_t>& bits, int width_px) {
  const size_t row_bytes = ValidityRowBytes(width_px);
  for (size_t i = bits.size(); i-- > row_bytes;) {
    bits[i] = static_cast<std::uint8_t>(bits[i] ^ bits[i - row_bytes]);
  }
}

void XorRowsBack(std::vector<std::uint8_t>& bits, int width_px) {
  const size_t row_bytes = ValidityRowBytes(width_px);
  for (size_t i = row_bytes; i < bits.size(); ++i) {
    bits[i] = static_cast<std::uint8_t>(bits[i] ^ bits[i - row_bytes]);
  }
  const int used_bits = (width_px - 1) % 8 + 1;
  const int padding = 255 & ~((1 << used_bits) - 1);
  for (size_t i = row_bytes; i <= bits.size(); i += row_bytes) {
    if ((bits[i - 1] & padding) != 0) FailCoded("0 beyond a row", "1");
  }
}

size_t CountBits(const std::vector<std::uint8_t>& bits) {
  size_t count = 0;
  for (const std::uint8_t byte : bits) count += static_cast<size_t>(std::popcount(byte));
  return count;
}

void AddResidual(std::uint16_t code, int predicted, CodeParts& parts) {
  const std::uint16_t folded = Folded(code - predicted);
  parts.residuals.push_back(static_cast<std::uint8_t>(std::min<int>(folded, kWide)));
  if (folded < kWide) return;
  parts.wide.push_back(static_cast<std::uint8_t>(folded & 255));
  parts.wide.push_back(static_cast<std::uint8_t>(folded >> 8));
}

void ResidualReader::ExpectNoHole() const {
  if (hole_) FailCoded("codes of at least 1 where there is depth", "0");
}

CodeParts SplitCodes(const Grid<std::uint16_t>& codes, int first_row, int rows) {
  const int width = codes.width();
  const size_t row_bytes = ValidityRowBytes(width);
  CodeParts parts;
  parts.validity.assign(row_bytes * static_cast<size_t>(rows), 0);
  PredictedSurface surface(width);
  for (int j = 0; j < rows; ++j) {
    const std::uint16_t* row = codes.row(first_row + j);
    std::uint8_t* bits = &parts.validity[row_bytes * static_cast<size_t>(j)];
    surface.BeginRow(j == 0);
    for (int x = 0; x < width; ++x) {
      const int predicted = surface.Prediction(x);
      if (row[x] == 0) {
        surface.Put(x, predicted);
        continue;
      }
      surface.Put(x, row[x]);
      SetBit(bits, x);
      AddResidual(row[x], predicted, parts);
    }
  }
  XorRows(parts.validity, width);
  return parts;
}

}  // namespace dtr::io
