#include "dtr/render/colour.h"

#include <cmath>

namespace dtr {

double LinearFromSrgb(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

double SrgbFromLinear(double linear) {
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

const std::array<double, 256>& LinearFromSrgb8() {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> linear{};
    for (int v = 0; v < 256; ++v) linear[static_cast<size_t>(v)] = LinearFromSrgb(v / 255.0);
    return linear;
  }();
  return table;
}

std::uint8_t Srgb8FromSrgb(double srgb) {
  if (!(srgb > 0)) return 0;
  if (srgb >= 1) return 255;
  return static_cast<std::uint8_t>(std::floor(srgb * 255 + 0.5));
}

std::uint8_t Srgb8FromLinear(double linear) {
  return linear > 0 ? Srgb8FromSrgb(SrgbFromLinear(linear)) : std::uint8_t{0};
}

}  // namespace dtr
