// dtr/advise/redundant.h -- cameras whose photos others show.
#pragma once
#include <span>
#include <vector>

#include "dtr/advise/advise.h"

namespace dtr::advise {

/// Cameras that may be left out together: each, and each left out before it, keeps
/// options.redundant_share of its points in cameras that stay, seen from within half of
/// options.max_gap_deg and at least 0.7 times as large. At least 2 cameras stay.
std::vector<Redundant> FindRedundant(std::span<const CoarseView> views,
                                     const AdviseOptions& options, Progress& progress);

}  // namespace dtr::advise
