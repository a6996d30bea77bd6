// stereo/background.h -- what a camera that does not move sees of what does not move.
#pragma once
#include <functional>
#include <span>

#include "dtr/types/grid.h"

namespace dtr::stereo {

/// Images of a view at several time steps, on one grid.
struct ViewOverTime {
  std::span<const ImageRgb8> images;
  std::span<const Mask> masks;  ///< one per image, or none; an empty one allows all of its image
};

struct Background {
  ImageRgb8 image;             ///< 8-bit sRGB, black where unknown
  Grid<std::uint8_t> support;  ///< time steps that each pixel is the mean of; 0: unknown
  double noise = 0;            ///< standard deviation of a photo's pixels, 8-bit levels
};

/// Standard deviation of the photos' noise, 8-bit levels: from differences of consecutive images
/// summed over blocks of 2x2 pixels and three channels, of which the median is what does not move
/// (as long as that is more than half), and no less than rounding to 8 bits. 0 for fewer than two
/// images.
double NoiseOverTime(const ViewOverTime& view);

/// Of each pixel the colour that most time steps agree on, the mean of those that do: images i and
/// j agree at a pixel where they differ by no more than noise explains (chi-square of three
/// channels, 99 %). Known is what at least three images and three tenths of those that may be used
/// there agree on. Throws std::invalid_argument for images of different sizes, none, or more than
/// kMaxTimeSteps.
Background FindBackground(const ViewOverTime& view);
inline constexpr size_t kMaxTimeSteps = 64;

/// 255: the photo shows something else than the background, or that is unknown, somewhere in the
/// window around the pixel that stereo compares (7x7): the mean squared difference is above what
/// noise explains (chi-square of the window's values, mean + 6 standard deviations, and a fifth for
/// noise that is not independent). A pixel that `usable` (empty: all) excludes counts as nothing.
Mask ChangedPixels(const ImageRgb8& image, const Mask& usable, const Background& background);

}  // namespace dtr::stereo
