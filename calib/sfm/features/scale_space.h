// calib/sfm/features/scale_space.h -- Gaussian scale space of an image and its extrema.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "calib/sfm/features/row_store.h"

namespace dtr::sfm {

constexpr int kScalesPerOctave = 3;
constexpr int kLevels = kScalesPerOctave + 3;  ///< blurred images of an octave
/// Blur of an octave's first level in its own pixels (Lowe, sec. 3.3), and that which a photo is
/// taken to have.
constexpr double kFirstSigma = 1.6, kCameraSigma = 0.5;

/// Which extrema are features; as SiftOptions.
struct ExtremumLimits {
  double min_contrast = 0;
  double max_curvature_ratio = 0;
};

/// An extremum of the difference of Gaussians, in pixels of its octave; the centre of the first
/// pixel is at 0.
struct Extremum {
  int level = 0;  ///< the blurred image below it: 1, 2 or 3
  float x = 0, y = 0;
  float sigma = 0;
};

/// An octave: the blurred images that features are described in, and the extrema, by rows.
struct Octave {
  int width = 0, height = 0;
  double pixel = 1;                      ///< its pixel in pixels of the photo: 0.5, 1, 2, ...
  std::array<RowStore, kLevels> levels;  ///< whole are 1 to kScalesPerOctave
  std::vector<Extremum> extrema;
};

/// The octave of the image at twice its size. Values of `image` must be finite.
Octave FirstOctave(const RowStore& image, int height, const ExtremumLimits& limits);

/// The octave above `below`. Requires that its sides are at least 2 px.
Octave NextOctave(const Octave& below, const ExtremumLimits& limits);

/// Memory of an octave without its extrema, bytes, what is freed at its end included.
std::size_t OctaveBytes(int width, int height);

}  // namespace dtr::sfm
