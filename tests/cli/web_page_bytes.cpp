#include "tests/cli/web_page_bytes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <vector>

namespace dtr::testing {
namespace {

struct Model {
  std::uint32_t quick = 32768, slow = 32768;
};

class BitReader {
 public:
  explicit BitReader(const std::string& bytes) : bytes_(bytes) {
    for (int i = 0; i < 5; ++i) code_ = code_ << 8 | Byte();
  }
  int Get(Model& model) {
    const std::uint32_t zeros =
        (range_ >> 16) * std::clamp((model.quick + model.slow) / 2, 48u, 65488u);
    const int bit = code_ >= zeros ? 1 : 0;
    if (bit == 1) {
      code_ -= zeros, range_ -= zeros;
      model.quick -= model.quick >> 4, model.slow -= model.slow >> 7;
    } else {
      range_ = zeros;
      model.quick += (65535 - model.quick) >> 4, model.slow += (65535 - model.slow) >> 7;
    }
    for (; range_ < 1u << 24; range_ <<= 8) code_ = code_ << 8 | Byte();
    return bit;
  }

 private:
  std::uint32_t Byte() {
    return at_ < bytes_.size() ? static_cast<unsigned char>(bytes_[at_++]) : 0u;
  }
  const std::string& bytes_;
  size_t at_ = 0;
  std::uint32_t code_ = 0, range_ = 0xffffffff;
};

// The residual of one value; models by any key.
int Residual(BitReader& reader, std::map<int, Model>& models, int activity, int slope) {
  const auto bit = [&](int kind, int index) { return reader.Get(models[1000 * kind + index]); };
  if (bit(0, 4 * activity + slope) == 0) return 0;
  const bool negative = bit(1, activity) == 1;
  int more = 0;
  while (more < 18 && bit(2, 18 * activity + more) == 1) ++more;
  if (more == 18) {
    int bits = 1, rest = 1;
    while (bits < 17 && bit(3, bits) == 1) ++bits;
    for (int i = bits - 2; i >= 0; --i) rest = 2 * rest + bit(4, i);
    more += rest - 1;
  }
  return negative ? -1 - more : 1 + more;
}

Grid<std::uint8_t> Places(const std::string& bytes, int columns, int rows) {
  Grid<std::uint8_t> places(columns, rows);
  BitReader reader(bytes);
  std::vector<Model> models(4096);
  const auto is = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < columns && y < rows ? places(x, y) : 0u;
  };
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int around[8][2] = {{-1, 0}, {0, -1}, {-1, -1}, {1, -1},
                                {-2, 0}, {0, -2}, {2, -1},  {-2, -1}};
      unsigned context = 0;
      for (int k = 0; k < 8; ++k) context |= is(x + around[k][0], y + around[k][1]) << k;
      places(x, y) = static_cast<std::uint8_t>(reader.Get(models[context]));
    }
  }
  return places;
}

}  // namespace

std::string Between(const std::string& text, const std::string& start, const std::string& end) {
  const size_t first = text.find(start);
  if (first == std::string::npos) return "";
  const size_t from = first + start.size();
  return text.substr(from, text.find(end, from) - from);
}

std::string BytesOfText(const std::string& text, size_t size) {
  std::string bits;
  const auto put = [&bits](unsigned seven) {
    for (int i = 6; i >= 0; --i) bits += static_cast<char>('0' + (seven >> i & 1));
  };
  for (size_t i = 0; i < text.size(); ++i) {
    const unsigned byte = static_cast<unsigned char>(text[i]);
    if (byte < 128) {
      put(byte);
      continue;
    }
    const unsigned code = (byte & 31) << 6 | (static_cast<unsigned char>(text.at(++i)) & 63u);
    put(std::vector<unsigned>{0, 10, 13, 60}.at((code >> 7) - 1));
    put(code & 127);
  }
  std::string bytes;
  for (size_t i = 0; i < size; ++i) {
    bytes += static_cast<char>(std::stoi(bits.substr(8 * i, 8), nullptr, 2));
  }
  return bytes;
}

Grid<std::uint16_t> DecodedMap(const std::string& place_bytes, const std::string& value_bytes,
                               int columns, int rows) {
  const Grid<std::uint8_t> places = Places(place_bytes, columns, rows);
  Grid<std::uint16_t> codes(columns, rows);
  Grid<int> values(columns, rows), residuals(columns, rows);
  BitReader reader(value_bytes);
  std::map<int, Model> models;
  const auto error = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < columns ? std::abs(residuals(x, y)) : 0;
  };
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int above = y > 0 ? values(x, y - 1) : x > 0 ? values(x - 1, 0) : 0;
      const int left = x > 0 ? values(x - 1, y) : above;
      const int corner = x > 0 && y > 0 ? values(x - 1, y - 1) : above;
      const int predicted =
          std::max(std::min(left, above), std::min(std::max(left, above), left + above - corner));
      values(x, y) = predicted;
      residuals(x, y) = (error(x - 1, y) + error(x, y - 1)) / 4;
      if (places(x, y) == 0) continue;
      const int sum =
          2 * (error(x - 1, y) + error(x, y - 1)) + error(x + 1, y - 1) + error(x - 1, y - 1);
      const int activity =
          sum < 6 ? sum : std::min(13, 3 + static_cast<int>(std::bit_width(unsigned(sum))));
      const int step = std::max(std::abs(left - corner), std::abs(above - corner));
      residuals(x, y) = Residual(reader, models, activity,
                                 step == 0   ? 0
                                 : step < 3  ? 1
                                 : step < 12 ? 2
                                             : 3);
      values(x, y) = predicted + residuals(x, y);
      codes(x, y) = static_cast<std::uint16_t>(values(x, y));
    }
  }
  return codes;
}

}  // namespace dtr::testing
