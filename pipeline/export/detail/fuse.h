// pipeline/export/detail/fuse.h -- the depth maps of a set as one surface: a sample for each patch.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "dtr/base/progress.h"
#include "pipeline/export/detail/surface_views.h"

namespace dtr::pipeline {

struct FuseOptions {
  int min_views = 2;            ///< that show a sample at the same depth, its own counted
  double tolerance_px = 1;      ///< they differ by at most so many pixels of disparity
  double tolerance_sigmas = 3;  ///< and by so many standard deviations of the difference
  int neighbours = 16;  ///< views that a sample is compared with; some more where these see it
};

/// A pixel of a depth map that stands for a patch of the surface.
struct FusedSample {
  int x = 0, y = 0;            ///< on the depth grid of the view that it is a pixel of
  Eigen::Vector3d p_in_world;  ///< on that pixel's ray; mean of all views that show it
  Eigen::Vector3f normal;      ///< unit length, to the camera, in the world
  float sigma = 0;             ///< standard deviation of its distance, scene units; 0: not known
  std::array<std::uint8_t, 3> rgb{};  ///< sRGB, mean of these views; 0 where they have no colours
  int views = 1;                      ///< that show it
  bool completed = false;             ///< its depth was not measured
};

/// What a view contributes, row by row from the top.
using FusedSink = std::function<void(const SurfaceView&, const std::vector<FusedSample>&)>;

/// Fuses all views with depth, in two passes over them. A sample of a view is compared with the
/// views that see its place (geometric consistency as in Schönberger et al. 2016, with standard
/// deviations besides): one whose surface lies within the tolerances confirms it, one that sees
/// farther there refutes it. It is kept where enough views confirm it and no more refute it.
/// - Its distance is the mean of what these views say along its ray, weighted by 1 / variance. Its
///   standard deviation is that of one of them, larger where they scatter more: depth maps of
///   overlapping photos err together.
/// - Every pixel of the confirming views within its patch is marked and gives no sample of its own.
/// - In the first pass a view leaves a patch to a later view that shows it clearly finer (distance
///   by focal length by cosine); the second pass takes what is left.
/// The same samples for any number of threads. Memory: the bound of `views`, a bit for every pixel
/// of all depth maps, and the samples of one view.
void Fuse(SurfaceViews& views, const FuseOptions& options, const FusedSink& sink,
          Progress& progress);

/// A few hundred points of the view's surface, in the world.
std::vector<Eigen::Vector3d> CoarsePoints(const SurfaceView& surface);

/// For each view with depth (by index into frames[0].views; others empty) the views that see most
/// of what it shows, at most `most` and those that it is one of itself, in rising order.
std::vector<std::vector<int>> ViewsThatSeeTheSame(SurfaceViews& views, int most);

}  // namespace dtr::pipeline
