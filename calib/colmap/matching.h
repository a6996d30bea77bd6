// calib/colmap/matching.h -- which photos are matched with which, and the matching.
#pragma once
#include <optional>
#include <utility>
#include <vector>

#include "calib/colmap/workspace.h"

namespace dtr::colmap {

/// kAuto resolved for a number of photos; other values unchanged.
Matching ResolveMatching(Matching matching, size_t images);

/// Numbers of two photos, a < b; sorted.
using ImagePairs = std::vector<std::pair<size_t, size_t>>;

/// Matches the photos of `database`; an interrupted call may be repeated on the same database. Of
/// the pairs that `matching` names only those of `allowed`, where it is given. Threads, and photos
/// held at a time, are bounded by `memory_gb` (GB of 1e9 bytes).
void MatchPhotos(Workspace& workspace, const std::filesystem::path& database, Matching matching,
                 double memory_gb, std::uint64_t seed,
                 const std::optional<ImagePairs>& allowed = {});

/// Matches listed pairs of photos, given by their names in the database.
void MatchPairs(Workspace& workspace, const std::filesystem::path& database,
                const std::vector<std::pair<std::string, std::string>>& pairs, int threads,
                std::uint64_t seed);

/// Percent done that a line of COLMAP's matchers reports ("Matching block [2/3, 1/3] in 0.1s",
/// "Processing image [4/9]"), or -1.
int MatchingPercent(const std::string& line);

/// Threads for the matchers within the memory limit. Each holds the distances of two photos'
/// features: 8192 x 8192 floats at COLMAP's limit, doubled for features with two orientations.
int MatchingThreads(double memory_gb);

}  // namespace dtr::colmap
