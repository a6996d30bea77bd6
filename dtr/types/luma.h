// dtr/types/luma.h -- brightness of a colour.
#pragma once
#include <cstdint>

namespace dtr {

/// Luma of an R, G, B triple (ITU-R BT.601) in 1/256 levels, as an integer so that sums are exact.
inline int Luma(const std::uint8_t* rgb) { return 77 * rgb[0] + 150 * rgb[1] + 29 * rgb[2]; }

}  // namespace dtr
