// dtr/render/degrees.h -- angles as people write them.
#pragma once
#include <numbers>

namespace dtr {

inline double RadiansOf(double degrees) { return degrees * std::numbers::pi / 180; }

/// Degrees with as few digits as RadiansOf takes back to the same bits.
double DegreesOf(double radians);

}  // namespace dtr
