// calib/colmap/matching.h -- matching by COLMAP.
#pragma once
#include <optional>
#include <utility>
#include <vector>

#include "calib/colmap/program.h"
#include "calib/sfm/run/feature_plan.h"

namespace dtr::colmap {

/// Matches the photos of `database`; an interrupted call may be repeated on the same database. Of
/// the pairs that `matching` names only those of `allowed`, where it is given. Threads, and photos
/// held at a time, are bounded by `memory_gb` (GB of 1e9 bytes).
void MatchPhotos(sfm::Workspace& workspace, const std::filesystem::path& database,
                 sfm::Matching matching, double memory_gb, std::uint64_t seed,
                 const std::optional<sfm::ImagePairs>& allowed = {});

/// Matches listed pairs of photos, given by their names in the database.
void MatchPairs(sfm::Workspace& workspace, const std::filesystem::path& database,
                const std::vector<std::pair<std::string, std::string>>& pairs, int threads,
                std::uint64_t seed);

/// Percent done that a line of COLMAP's matchers reports ("Matching block [2/3, 1/3] in 0.1s",
/// "Processing image [4/9]"), or -1.
int MatchingPercent(const std::string& line);

/// Threads for the matchers within the memory limit. Each holds the distances of two photos'
/// features: 8192 x 8192 floats at COLMAP's limit, doubled for features with two orientations.
int MatchingThreads(double memory_gb);

}  // namespace dtr::colmap
