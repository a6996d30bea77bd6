// dtr/render/colour.h -- the sRGB transfer curve (IEC 61966-2-1).
#pragma once
#include <array>
#include <cstdint>

namespace dtr {

/// Linear light in [0, 1] of an sRGB value in [0, 1]; no clamping.
double LinearFromSrgb(double srgb);
/// Inverse of LinearFromSrgb.
double SrgbFromLinear(double linear);
/// Linear light of each 8-bit sRGB value; exact inverses: Srgb8FromLinear(table[v]) == v.
const std::array<double, 256>& LinearFromSrgb8();
/// The nearest 8-bit sRGB value; values outside [0, 1] are clamped, NaN gives 0.
std::uint8_t Srgb8FromLinear(double linear);
/// The nearest 8-bit value of an sRGB value in [0, 1], clamped alike.
std::uint8_t Srgb8FromSrgb(double srgb);

}  // namespace dtr
