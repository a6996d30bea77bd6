// dtr/exposure/compare_exposures.h -- how differently two photos of one scene were exposed.
#pragma once
#include <optional>

#include "dtr/exposure/estimate_gains.h"

namespace dtr {

struct ExposurePair {
  int a, b;
  double weight;                 ///< at most 1
  Eigen::Vector3d log_exposure;  ///< from what a shows to what b shows
};

/// Compares what views `a` and `b` show of the surfaces that both measured within half a
/// pixel of disparity. Patches of a are compared as a whole: the light of a surface stays the same
/// on a patch, however blurred or displaced by a pixel its texture is, while the logarithms of
/// single pixels do not. The exposure is where most patches agree in all channels. Empty where they
/// have little in common.
std::optional<ExposurePair> CompareExposures(std::span<const SmallView> views, int a, int b);

}  // namespace dtr
