#include "capture/video/display_matrix.h"

#include <algorithm>
#include <cmath>

namespace dtr::capture {
namespace {

// Cameras write whole numbers; players write what sines and cosines of 90 degrees leave.
constexpr double kSmall = 0.01;  // of the larger entry in a column

// -1, 0, +1 for an entry beside the other one of its column; nothing where both count.
std::optional<std::array<int, 2>> SignsOf(double first, double second) {
  const double larger = std::max(std::abs(first), std::abs(second));
  if (larger == 0) return {};
  const auto sign = [&](double value) {
    return std::abs(value) <= kSmall * larger ? 0 : (value > 0 ? 1 : -1);
  };
  const std::array<int, 2> signs{sign(first), sign(second)};
  if ((signs[0] == 0) == (signs[1] == 0)) return {};
  return signs;
}

}  // namespace

std::optional<int> ExifOrientationOf(const DisplayMatrix& matrix) {
  const auto right = SignsOf(matrix[0], matrix[1]);  // where the stored frame's x axis goes
  const auto down = SignsOf(matrix[3], matrix[4]);   // and its y axis
  if (!right || !down) return {};
  const auto [a, b] = *right;
  const auto [c, d] = *down;
  if (b == 0 && c == 0) {  // EXIF 2.3, tag 0x0112: 1 to 4 keep rows rows
    if (d > 0) return a > 0 ? 1 : 2;
    return a > 0 ? 4 : 3;
  }
  if (a != 0 || d != 0) return {};  // both axes on one line
  if (b > 0) return c > 0 ? 5 : 6;  // 5: transposed; 6: the stored left edge is the top
  return c > 0 ? 8 : 7;
}

}  // namespace dtr::capture
