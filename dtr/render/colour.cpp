#include "dtr/render/colour.h"

#include <algorithm>
#include <cmath>

namespace dtr {
namespace {

/// The curve read backwards without a power: the linear light at which each 8-bit value gives way
/// to the next, and the value that every 4096th part of the range begins with. The curve rises by
/// at most 0.8 values within a part, so that one comparison is enough.
class NearestSrgb8 {
 public:
  NearestSrgb8() {
    for (int v = 0; v < 256; ++v) limits_[static_cast<size_t>(v)] = LinearFromSrgb((v + 0.5) / 255);
    for (size_t part = 0; part < kParts; ++part) {
      const auto above =
          std::upper_bound(limits_.begin(), limits_.end(), static_cast<double>(part) / kParts);
      first_[part] = static_cast<std::uint8_t>(above - limits_.begin());
    }
  }
  /// `linear` in (0, 1).
  std::uint8_t Of(double linear) const {
    const std::uint8_t first = first_[static_cast<size_t>(linear * kParts)];
    return static_cast<std::uint8_t>(first + (linear >= limits_[first] ? 1 : 0));
  }

 private:
  static constexpr size_t kParts = 4096;
  std::array<double, 256> limits_{};
  std::array<std::uint8_t, kParts> first_{};
};

}  // namespace

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
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 255;
  static const NearestSrgb8 nearest;
  return nearest.Of(linear);
}

}  // namespace dtr
