// calib/sfm/run/view_pyramids.h -- which photos with known cameras can show the same thing at all.
#pragma once
#include <span>

#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/known_poses.h"

namespace dtr::sfm {

/// True where no point lies in both photos, however far off: a plane separates their pyramids of
/// view, which are taken larger than the images by kPyramidMargin of their size on every side, for
/// poses are never exact. False for cameras with distortion, whose views are no pyramids.
bool CannotOverlap(const PosedImage& a, const PosedImage& b);
inline constexpr double kPyramidMargin = 0.05;

/// Pairs (a < b, sorted) of images for which CannotOverlap is false.
ImagePairs PairsThatMayOverlap(std::span<const PosedImage> images);

}  // namespace dtr::sfm
