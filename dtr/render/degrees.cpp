#include "dtr/render/degrees.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace dtr {

double DegreesOf(double radians) {
  constexpr int kMaxDigits = 17;
  const double degrees = radians * 180 / std::numbers::pi;
  for (int digits = 1; digits <= kMaxDigits; ++digits) {
    const double rounded = std::stod(fmt::format("{:.{}g}", degrees, digits));
    if (RadiansOf(rounded) == radians) return rounded;
  }
  // The way back rounds, too: the neighbours are what is left.
  const double above = std::nextafter(degrees, HUGE_VAL);
  return RadiansOf(above) == radians ? above : std::nextafter(degrees, 0);
}

}  // namespace dtr
