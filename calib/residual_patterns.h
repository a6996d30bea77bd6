// calib/residual_patterns.h -- patterns of residuals over an image that no lens model follows, of
// boards' corners and of photos' features alike.
#pragma once
#include <Eigen/Core>
#include <array>
#include <string>

#include "dtr/types/check.h"

namespace dtr::calib {

/// Rings around the principal point: along the radius.
inline constexpr int kRings = 6;
/// Weights of the rings at a radius, given as a share of the largest that any residual has: hat
/// functions centred on the rings' outer edges, none at the middle, where there is no direction.
std::array<double, kRings> RingWeights(double radius_share);

/// Regions of an image per axis: a mean vector in each.
inline constexpr int kPatternRegions = 4;
/// Row by row; the nearest one for a pixel off the image.
int PatternRegionOf(const Eigen::Vector2d& pixel, int width_px, int height_px);

/// A pattern held against its limit: `amplitude_px` is what it explains, RMS per coordinate, and
/// `p` how likely as much is by chance. What is as likely as `min_p` counts as 0 px.
Check PatternCheck(const char* name, const std::string& what, double p, double amplitude_px,
                   double min_p, double limit_px);

}  // namespace dtr::calib
