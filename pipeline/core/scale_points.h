// pipeline/core/scale_points.h -- points of a set that somebody points at in its images.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace dtr::pipeline
