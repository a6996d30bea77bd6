#include "dtr/io/formats/pfm.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/text_numbers.h"

namespace dtr::io {
namespace {

constexpr std::uintmax_t kMaxPfmBytes = std::uintmax_t{4} << 30;  // 1 Gpx of one channel
constexpr int kMaxSidePx = 1 << 16;

// The next word of the header; `position` ends behind the one blank that follows the word.
std::string_view HeaderWord(std::string_view bytes, size_t& position, const std::string& source) {
  constexpr size_t kMaxWord = 64;
  while (position < bytes.size() && internal::IsBlank(bytes[position])) ++position;
  const size_t begin = position;
  while (position < bytes.size() && !internal::IsBlank(bytes[position])) {
    if (++position - begin > kMaxWord) break;
  }
  if (position >= bytes.size() || !internal::IsBlank(bytes[position])) {
    throw Error(source + ": expected a PFM header (type, width, height, scale), found other bytes");
  }
  return bytes.substr(begin, position++ - begin);
}

template <typename Number>
Number NumberFrom(std::string_view word, const char* what, const std::string& source) {
  Number number{};
  const auto result = std::from_chars(word.data(), word.data() + word.size(), number);
  if (result.ec != std::errc() || result.ptr != word.data() + word.size()) {
    throw Error(source + ": expected " + what + " in the PFM header, found something else");
  }
  return number;
}

float FloatFrom(const char* bytes, bool little_endian) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 4; ++i) {
    bits = bits << 8 | static_cast<unsigned char>(bytes[little_endian ? 3 - i : i]);
  }
  return std::bit_cast<float>(bits);
}

}  // namespace

Grid<float> ParsePfm(std::string_view bytes, const std::string& source) {
  size_t position = 0;
  const std::string_view type = HeaderWord(bytes, position, source);
  if (type != "Pf" && type != "PF") {
    throw Error(source + ": expected a PFM file (it begins with Pf or PF), found another");
  }
  const size_t channels = type == "PF" ? 3 : 1;
  const int width_px = NumberFrom<int>(HeaderWord(bytes, position, source), "a width", source);
  const int height_px = NumberFrom<int>(HeaderWord(bytes, position, source), "a height", source);
  const double scale = NumberFrom<double>(HeaderWord(bytes, position, source), "a scale", source);
  if (width_px < 1 || height_px < 1 || width_px > kMaxSidePx || height_px > kMaxSidePx) {
    throw Error(source + ": expected sides of 1 to 65536 pixels, found " +
                std::to_string(width_px) + "x" + std::to_string(height_px));
  }
  if (!std::isfinite(scale) || scale == 0) {
    throw Error(source + ": expected a scale other than 0 in the PFM header, found another");
  }
  const size_t row_bytes = static_cast<size_t>(width_px) * channels * 4;
  if (bytes.size() - position != row_bytes * static_cast<size_t>(height_px)) {
    throw Error(source + ": expected " + std::to_string(row_bytes * size_t(height_px)) +
                " bytes of pixels, found " + std::to_string(bytes.size() - position));
  }
  Grid<float> grid(width_px, height_px, static_cast<int>(channels));
  for (int y = 0; y < height_px; ++y) {
    const char* from = bytes.data() + position + row_bytes * static_cast<size_t>(height_px - 1 - y);
    float* to = grid.row(y);
    for (size_t i = 0; i < row_bytes / 4; ++i) to[i] = FloatFrom(from + 4 * i, scale < 0);
  }
  return grid;
}

Grid<float> ReadPfm(const std::filesystem::path& file) {
  return ParsePfm(ReadFile(file, kMaxPfmBytes), file.string());
}

void WritePfm(const std::filesystem::path& file, const Grid<float>& grid, bool little_endian) {
  if (grid.empty() || (grid.channels() != 1 && grid.channels() != 3)) {
    throw std::invalid_argument("WritePfm: expected pixels of 1 or 3 channels");
  }
  std::string bytes = std::string(grid.channels() == 3 ? "PF\n" : "Pf\n") +
                      std::to_string(grid.width()) + " " + std::to_string(grid.height()) + "\n" +
                      (little_endian ? "-1\n" : "1\n");
  const size_t row_values =
      static_cast<size_t>(grid.width()) * static_cast<size_t>(grid.channels());
  bytes.reserve(bytes.size() + grid.data().size() * 4);
  for (int y = grid.height() - 1; y >= 0; --y) {
    const float* row = grid.row(y);
    for (size_t i = 0; i < row_values; ++i) {
      const auto bits = std::bit_cast<std::uint32_t>(row[i]);
      for (int b = 0; b < 4; ++b) {
        bytes.push_back(static_cast<char>(bits >> (8 * (little_endian ? b : 3 - b)) & 0xff));
      }
    }
  }
  WriteFileAtomically(file, bytes);
}

}  // namespace dtr::io
