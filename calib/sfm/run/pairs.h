// calib/sfm/run/pairs.h -- which photos resemble each other, seen on small images.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/grid.h"

namespace dtr::sfm {

/// Unit-length SIFT descriptors of a small image, 128 numbers each, one per row.
using SmallFeatures = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline constexpr int kSmallSidePx = 512;    ///< long side of the small images
inline constexpr int kSmallFeatures = 384;  ///< the strongest features kept of each
/// Neighbours every photo keeps. 20 of 300 photos are 7 % of all pairs; a photo set that connects
/// through its best 20 of rank is what COLMAP's own vocabulary trees aim at (they take 100).
inline constexpr int kNeighbours = 20;

/// The strongest SIFT features of an image scaled down to kSmallSidePx (RootSIFT: Arandjelovic and
/// Zisserman, CVPR 2012). Deterministic.
SmallFeatures SmallFeaturesOf(const ImageRgb8& image);

/// Number of mutual nearest neighbours that pass the ratio test both ways: how much two photos
/// share. Symmetric.
int Resemblance(const SmallFeatures& a, const SmallFeatures& b);

/// Of those a photo resembles surely (kSure shared features or more) the kNearest most resembling
/// are kept, and the rest of the kNeighbours from among all others, spread geometrically by rank:
/// in a dense capture the most resembling alone are all next to each other, and baselines as short
/// as that give no pair to start a model from (docs/accuracy/SPEED.md, 300 photos). Plaza's
/// neighbours share more than 30 features; 12 and 20 themselves are choices, not measured.
inline constexpr int kNearest = 12, kSure = 20;

/// Indices (sorted) of at most kNeighbours photos to match with, by how much each is resembled;
/// scores of 0 never. Ties go to the lower index.
std::vector<size_t> Partners(const std::vector<int>& scores);

/// Pairs (a < b, sorted) worth matching in full: every photo with its Partners and with the next in
/// order, so that a chain through poor photos is not cut.
/// As many photos at a time are held as fit into `memory_gb` (GB of 1e9 bytes), one at least; 0: no
/// bound. Deterministic for any number of threads. Throws Error when a photo cannot be read.
std::vector<std::pair<size_t, size_t>> PreselectPairs(std::span<const std::filesystem::path> files,
                                                      int threads, double memory_gb,
                                                      Progress& progress);

/// SmallFeaturesOf each of the photos, under the bound of PreselectPairs.
/// Throws Error when a photo cannot be read.
std::vector<SmallFeatures> SmallFeaturesOfFiles(std::span<const std::filesystem::path> files,
                                                int threads, double memory_gb, Progress& progress);

/// Indices (sorted) of the at most kNeighbours of `others` that resemble a photo most.
std::vector<size_t> MostResembling(const SmallFeatures& photo,
                                   std::span<const SmallFeatures> others);

}  // namespace dtr::sfm
