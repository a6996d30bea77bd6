// calib/sfm/features/descriptor.h -- from histograms to orientations and stored descriptors.
#pragma once
#include <array>
#include <vector>

#include "calib/sfm/features/patch_kernel.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm {

/// The directions, radians in [0, 2 pi), of at most `max_count` peaks of the smoothed histogram
/// that reach 0.8 of the highest; the strongest first (Lowe, sec. 5).
std::vector<float> Orientations(std::array<float, kDirections> histogram, int max_count);

/// Histograms clamped to 0.2 of their length (Lowe, sec. 6.1) and stored as the square roots of
/// their shares of the sum ("RootSIFT": Arandjelovic and Zisserman, CVPR 2012) times 512, in
/// COLMAP's order of bins. All zeros where there is no gradient.
Descriptor StoredDescriptor(const std::array<float, kCells * kCells * kCellDirections>& cells);

}  // namespace dtr::sfm
