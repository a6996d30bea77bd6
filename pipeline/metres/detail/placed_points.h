// pipeline/metres/detail/placed_points.h -- where the points lie that somebody points at in images.
#pragma once
#include <Eigen/Core>
#include <filesystem>

#include "dtr/types/dtr_set.h"
#include "pipeline/core/scale_points.h"

namespace dtr::pipeline {

/// Where it is in the set's stored world, and how uncertain: scene units squared.
struct PlacedPoint {
  Eigen::Vector3d p_in_world;
  Eigen::Matrix3d covariance;
};

/// A click errs by 1 px per axis of the image; a depth by the view's sigma there, or by a pixel of
/// disparity over the reference baseline where the view has none. Several clicks are triangulated.
/// The cameras' own errors are not in it. Throws Error where the view has no depth, the rays do not
/// meet (more than 5 px off) or are too parallel.
PlacedPoint Place(const std::filesystem::path& folder, const DtrSet& set, const ScalePoint& point);

}  // namespace dtr::pipeline
