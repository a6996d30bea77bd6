// pipeline/core/scale_points.h -- points of a set that somebody points at in its images.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// A pixel of a view of the first frame; without a pixel, the view's camera centre is meant.
struct ScaleClick {
  std::string view_id;                   ///< of a set; elsewhere a photo's name as somebody gave it
  std::optional<Eigen::Vector2d> pixel;  ///< origin at the outer corner of the top-left pixel
};

/// One point: a camera centre, a pixel of a view that has depth there, or pixels of several views
/// that show the same point.
struct ScalePoint {
  std::string text;  ///< as it was given, for errors
  std::vector<ScaleClick> clicks;
};

/// `--distance A,B=LENGTH`.
struct ScaleDistance {
  std::string text;  ///< as it was given, for errors
  ScalePoint a, b;
  double length_m = 0;
  double sigma_m = 0;  ///< 0: not stated
};

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
