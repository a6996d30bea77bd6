// calib/boards/corner_noise.h -- how exactly can this image say where its corners are?
#pragma once
#include <cstdint>
#include <span>

#include "calib/boards/observations.h"
#include "dtr/types/grid.h"

namespace dtr::calib {

/// Standard deviation of the pixels' noise in grey levels, from the part of the image that the
/// corners span: the median of what a mask that sees neither planes nor steps along the axes
/// answers (Immerkaer 1996), at least the 0.29 levels of rounding. Compression that smooths makes
/// it small.
double PixelNoise(const Grid<std::uint8_t>& grey, std::span<const BoardCorner> corners);

/// Standard deviation in pixels of a coordinate of these corners, as noise of the pixels makes it:
/// a corner is where gradients g at places p are orthogonal to the way to it, q = A^-1 sum w g g^T
/// p, and noise of the pixels around it, taken as independent, is carried through that formula to
/// first order. The median over the corners. A lower bound: motion, a bent board, or what the
/// detector makes of blur and of the pixel grid are not in it. NaN when fewer than 4 corners lie
/// far enough inside the image.
double CornerNoise(const Grid<std::uint8_t>& grey, std::span<const BoardCorner> corners,
                   int half_window_px);

}  // namespace dtr::calib
