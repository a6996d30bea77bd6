#include "pipeline/export/web/coded_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "dtr/io/code_residuals.h"
#include "pipeline/export/web/bit_coder.h"

namespace dtr::pipeline {
namespace {

// Residuals by how large those around were: 0...5 one by one, then by powers of two.
constexpr int kActivities = 14, kPlainActivities = 6;
constexpr int kSlopes = 4;       // steps between the three neighbours
constexpr int kUnarySteps = 18;  // larger magnitudes in Elias' gamma code
constexpr int kGammaBits = 17;

int Activity(int west, int north, int north_east, int north_west) {
  const int sum =
      2 * (std::abs(west) + std::abs(north)) + std::abs(north_east) + std::abs(north_west);
  if (sum < kPlainActivities) return sum;
  return std::min(kActivities - 1,
                  3 + static_cast<int>(std::bit_width(static_cast<unsigned>(sum))));
}

int Slope(int left, int above, int above_left) {
  const int step = std::max(std::abs(left - above_left), std::abs(above - above_left));
  return step == 0 ? 0 : step < 3 ? 1 : step < 12 ? 2 : 3;
}

class ResidualEncoder {
 public:
  void Put(int residual, int activity, int slope) {
    encoder_.Put(zero_[activity][slope], residual != 0);
    if (residual == 0) return;
    encoder_.Put(sign_[activity], residual < 0);
    const int more = std::abs(residual) - 1;
    for (int i = 0; i < std::min(more, kUnarySteps); ++i) encoder_.Put(unary_[activity][i], true);
    if (more < kUnarySteps) {
      encoder_.Put(unary_[activity][more], false);
      return;
    }
    const auto rest = static_cast<unsigned>(more - kUnarySteps + 1);
    const int bits = static_cast<int>(std::bit_width(rest));
    for (int i = 1; i < bits; ++i) encoder_.Put(length_[i], true);
    encoder_.Put(length_[bits], false);
    for (int i = bits - 2; i >= 0; --i) encoder_.Put(digit_[i], (rest >> i & 1) != 0);
  }
  std::string Finish() { return encoder_.Finish(); }

 private:
  BitEncoder encoder_;
  BitModel zero_[kActivities][kSlopes], sign_[kActivities], unary_[kActivities][kUnarySteps];
  BitModel length_[kGammaBits + 1], digit_[kGammaBits];
};

}  // namespace

std::string CodedPlaces(const Grid<std::uint16_t>& map, const Grid<std::uint16_t>& known) {
  const auto is = [](const Grid<std::uint16_t>& grid, int x, int y) {
    return x >= 0 && y >= 0 && x < grid.width() && y < grid.height() && grid(x, y) != 0 ? 1u : 0u;
  };
  std::vector<BitModel> models(1 << 12);
  BitEncoder encoder;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (is(known, x, y)) continue;
      const unsigned context =
          is(map, x - 1, y) | is(map, x, y - 1) << 1 | is(map, x - 1, y - 1) << 2 |
          is(map, x + 1, y - 1) << 3 | is(map, x - 2, y) << 4 | is(map, x, y - 2) << 5 |
          is(map, x + 2, y - 1) << 6 | is(map, x - 2, y - 1) << 7 | is(known, x + 1, y) << 8 |
          is(known, x, y + 1) << 9 | is(known, x - 1, y) << 10 | is(known, x, y - 1) << 11;
      encoder.Put(models[context], is(map, x, y) != 0);
    }
  }
  return encoder.Finish();
}

std::string CodedValues(const Grid<std::uint16_t>& map) {
  const int width = map.width();
  ResidualEncoder encoder;
  // Of this row and the one above: values (those predicted, where there is none) and residuals, a
  // column beyond either end.
  std::vector<int> values(static_cast<size_t>(width) + 2), above_values(values);
  std::vector<int> residuals(values), above_residuals(values);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(x) + 1;
      const int above = y == 0 ? (x == 0 ? 0 : values[i - 1]) : above_values[i];
      const int left = x == 0 ? above : values[i - 1];
      const int above_left = y == 0 || x == 0 ? above : above_values[i - 1];
      const int predicted = io::PredictedCode(left, above, above_left);
      const int west = x == 0 ? 0 : residuals[i - 1], north = above_residuals[i];
      const int value = map(x, y);
      if (value == 0) {
        values[i] = predicted;
        residuals[i] = (std::abs(west) + std::abs(north)) / 4;
        continue;
      }
      values[i] = value;
      residuals[i] = value - predicted;
      encoder.Put(value - predicted,
                  Activity(west, north, above_residuals[i + 1], above_residuals[i - 1]),
                  Slope(left, above, above_left));
    }
    std::swap(values, above_values);
    std::swap(residuals, above_residuals);
  }
  return encoder.Finish();
}

}  // namespace dtr::pipeline
