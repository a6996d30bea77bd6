// dtr/types/computable.h -- lengths that everything here can compute with.
#pragma once

namespace dtr {

/// Positions and depths in scene units: their squares fit float32, in which fast renderers compute.
inline constexpr double kMaxLength = 1e18, kMinLength = 1e-18;

}  // namespace dtr
