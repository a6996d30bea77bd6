// calib/sfm/run/pairs.h -- which photos resemble each other, where their features are not there
// yet.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/view_graph.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

inline constexpr int kSmallSidePx = 512;    ///< long side of the small images that are looked at
inline constexpr int kSmallFeatures = 600;  ///< as many of each as ChoosePairs looks at

/// The largest features of small images of the photos. As many
/// photos at a time are held as fit into `memory_gb` (GB of 1e9 bytes), one at least; 0: no bound.
/// Deterministic for any number of threads. Throws Error when a photo cannot be read.
std::vector<Features> SmallFeaturesOf(std::span<const std::filesystem::path> files,
                                      double memory_gb, Progress& progress);

/// The pairs that are worth matching in full (matching/pair_choice.h, ChoosePairs), of those of
/// `allowed` where it is given, by features of SmallFeaturesOf. Throws as it does.
ImagePairs PreselectPairs(std::span<const std::filesystem::path> files,
                          const std::optional<ImagePairs>& allowed, double memory_gb,
                          Progress& progress);

/// Indices (sorted) of the at most matching::kPartners of `others` that resemble a photo most.
std::vector<size_t> MostResembling(const Features& photo, std::span<const Features> others);

}  // namespace dtr::sfm
