// calib/sfm/features/patch_kernel.h -- orientations and descriptors of patches of an image.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace dtr::sfm {

/// Bins of the histogram of gradient directions in which orientations are looked for.
constexpr int kDirections = 36;
/// Cells of a descriptor in each direction, and directions of each cell.
constexpr int kCells = 4, kCellDirections = 8;
/// A descriptor reads every second row, counted from its own: patches are blurred by 1.8 pixels or
/// more, so that neighbouring rows say nearly the same. On plaza this costs 0.4 % of the matches
/// and saves a third of the time.
constexpr int kDescriptorRowStep = 2;

/// A feature in its blurred image: position and scale in pixels, centre of the first pixel at 0.
struct PatchPosition {
  const float* pixels = nullptr;  ///< first of the image; rows may be read 64 values further
  std::size_t stride = 0;         ///< values from row to row
  int width = 0, height = 0;
  float x = 0, y = 0, sigma = 0;
};

/// Directions of the gradients in a circle of 4.5 sigma, weighted with their magnitudes and a
/// Gaussian of 1.5 sigma (Lowe, sec. 5); bin i is around (i + 1/2) / 36 of a full turn.
std::array<float, kDirections> DirectionHistogram(const PatchPosition& at);

/// Gradients in 4 x 4 cells of 3 sigma, rotated by `orientation_rad`, trilinearly shared between
/// bins and weighted with a Gaussian of 2 cells (Lowe, sec. 6): not normalised; rows of cells from
/// -y to +y, cells from -x to +x, directions from +x towards +y, all as the feature is rotated.
/// Only rows at a multiple of kDescriptorRowStep from the feature's are read.
std::array<float, kCells * kCells * kCellDirections> GradientCells(const PatchPosition& at,
                                                                   float orientation_rad);

}  // namespace dtr::sfm
