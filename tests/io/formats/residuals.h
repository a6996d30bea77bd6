// tests/io/formats/residuals.h -- do cameras, images and depth fit together? Conventions read
// wrongly (a swapped axis, an inverted pose, a slipped pixel) show here as large residuals.
#pragma once
#include <filesystem>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/types/depth_image.h"

namespace dtr::testing {

/// A point seen in two images, in our pixels.
struct PixelPair {
  Eigen::Vector2d a, b;
};

/// SIFT matches of two images (each other's best, ratio 0.8), shrunk to `width_px` for speed;
/// pixels are of the images as they are.
std::vector<PixelPair> MatchImages(const std::filesystem::path& image_a,
                                   const std::filesystem::path& image_b, int width_px);

/// Median distance in px of matches to their epipolar lines, in both images.
double MedianEpipolarPx(const io::NamedCamera& a, const io::NamedCamera& b,
                        const std::vector<PixelPair>& pairs);

/// How well the depth of one view, carried into another, meets the depth there.
struct DepthFit {
  double median_difference = 0;  ///< |z carried - z found|, scene units
  double median_relative = 0;    ///< the same over z
  int samples = 0;               ///< points inside both views, on smooth surfaces seen by both
};
/// Every 5th pixel of `depth_a`; `depth_b` is interpolated linearly in 1/z over 2x2 pixels that
/// agree to 2 %, so that planes are met exactly; points farther than 10 % behind or before what b
/// sees are hidden from it and do not count.
DepthFit CarryDepth(const io::NamedCamera& a, const DepthImage& depth_a, const io::NamedCamera& b,
                    const DepthImage& depth_b);

/// Wrong on purpose, for the negative controls.
io::NamedCamera WithShift(io::NamedCamera named, double dx_px, double dy_px);
/// The pose as if its axes had been read as OpenGL's (y up, z back).
io::NamedCamera WithFlippedAxes(io::NamedCamera named);
/// The pose as if it had been stored the other way round.
io::NamedCamera WithInvertedPose(io::NamedCamera named);

}  // namespace dtr::testing
