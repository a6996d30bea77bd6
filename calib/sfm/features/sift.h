// calib/sfm/features/sift.h -- SIFT features of one photo.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "calib/sfm/view_graph.h"

namespace dtr::sfm {

/// How features are detected. The defaults are COLMAP's.
struct SiftOptions {
  int max_features = 8192;         ///< the largest ones are kept
  int max_size_px = 3200;          ///< larger photos are shrunk to this long side first; 0: never
  int octaves = 4;                 ///< the first is that of the image at twice its size
  double min_contrast = 0.02 / 3;  ///< of an extremum of the difference of Gaussians; white is 1
  /// Largest ratio of the principal curvatures: more is an edge, along which a feature has no
  /// position.
  double max_curvature_ratio = 10;
  int max_orientations = 2;  ///< features at one position; the strongest
};

/// SIFT (Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 2004) of a grey
/// image, shape (height, width), row-major: features sorted by scale, the largest first, then by
/// position. Values of the first form are 0 to 255, of the second 0 to 1; others are clamped and
/// NaN counts as 0. `mask`: empty, or of the same shape; no feature lies where it is 0 (its
/// neighbours' descriptors still see those pixels). Images with a side below 8 px have no features.
/// Runs on the calling thread; the result does not depend on the instruction set in use.
/// Throws std::invalid_argument when sizes do not match, or an option is out of its range.
Features DetectSift(std::span<const std::uint8_t> grey, int width_px, int height_px,
                    std::span<const std::uint8_t> mask, const SiftOptions& options);
Features DetectSift(std::span<const float> grey, int width_px, int height_px,
                    std::span<const std::uint8_t> mask, const SiftOptions& options);

/// Upper bound of the memory that DetectSift takes for such an image, bytes, without the arguments
/// and as long as its extrema number less than one in 8 pixels.
std::size_t SiftBytes(int width_px, int height_px, const SiftOptions& options = {});

/// Instruction set in use, for example "AVX2".
const char* SiftInstructionSet();

}  // namespace dtr::sfm
