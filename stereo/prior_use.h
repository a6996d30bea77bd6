// stereo/prior_use.h -- what all that uses a view's prior agrees on; internal to stereo/.
#pragma once
#include <cstdint>

#include "dtr/types/camera.h"

namespace dtr::stereo {

/// A depth and that of a prior are of the same surface within so many standard deviations.
inline constexpr double kPriorSigmas = 2.5;

/// Bytes of a view's prior at work, which is no finer than the view: a map, its inverse and planes.
inline std::uint64_t PriorBytes(const PinholeCamera& camera) {
  return (4 + 4 + 13) * static_cast<std::uint64_t>(camera.width_px()) *
         static_cast<std::uint64_t>(camera.height_px());
}

}  // namespace dtr::stereo
