#include "dtr/io/code_residuals.h"

namespace dtr::io {
namespace {

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...; differences are taken modulo 2^16.
std::uint16_t Folded(int difference) {
  const auto d = static_cast<std::int16_t>(difference);
  return static_cast<std::uint16_t>((d << 1) ^ (d >> 15));
}

}  // namespace

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
      bits[x / 8] = static_cast<std::uint8_t>(bits[x / 8] | 1 << (x % 8));
      const std::uint16_t folded = Folded(row[x] - predicted);
      parts.residuals.push_back(static_cast<std::uint8_t>(std::min<int>(folded, kWide)));
      if (folded < kWide) continue;
      parts.wide.push_back(static_cast<std::uint8_t>(folded & 255));
      parts.wide.push_back(static_cast<std::uint8_t>(folded >> 8));
    }
  }
  for (size_t i = parts.validity.size(); i-- > row_bytes;) {
    parts.validity[i] =
        static_cast<std::uint8_t>(parts.validity[i] ^ parts.validity[i - row_bytes]);
  }
  return parts;
}

}  // namespace dtr::io
