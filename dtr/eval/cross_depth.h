// dtr/eval/cross_depth.h -- do the views of a set tell the same story?
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dtr/types/check.h"
#include "dtr/types/view.h"

namespace dtr::eval {

struct CrossDepthOptions {
  int neighbours = 4;              ///< per view, the nearest by angle at `scene_center`
  double max_cross_px = 1.0;       ///< limit of the median round trip of all views together
  double max_view_cross_px = 2.0;  ///< the same for the worst view
  int samples_per_view = 50000;    ///< depth pixels on a regular grid; enough for any median
  /// Where angles are measured; without it neighbours are the nearest cameras.
  std::optional<Eigen::Vector3d> scene_center;
  /// Depth maps that are held at a time where they are brought one by one; a view and its
  /// neighbours are, whatever they take. The result does not depend on it.
  size_t memory_bytes = size_t{1} << 30;
};

/// Round trips of one view's depth through its neighbours.
struct CrossDepthOfView {
  std::string name;
  long long compared = 0;      ///< pixels that landed on a smooth, not nearer surface
  long long occluded = 0;      ///< the neighbour sees something nearer: no statement
  long long contradicted = 0;  ///< of the compared: the neighbour sees through this view's surface
  double median_px = 0, p95_px = 0;  ///< of the compared; meaningful when compared > 0
};

struct CrossDepthReport {
  std::vector<Check> tests;  ///< cross_depth_px, worst_view_cross_depth_px
  std::vector<CrossDepthOfView> views;
  CrossDepthOfView all;
  bool passed() const { return AllPassed(tests); }
};

/// Carries depth pixels of each view into its neighbours and back: the surface point of pixel p is
/// projected into the neighbour, the neighbour's own surface there (inverse depth interpolated
/// where it is smooth; edges are passed over) is carried back, and the distance to p in pixels of
/// the view's image is the error: the forward-backward reprojection error of Schoenberger et al.,
/// "Pixelwise View Selection", ECCV 2016. A surface that returns more than 3 px away and lies in
/// front is an occlusion and tells nothing; one that lies behind is a contradiction and counts in
/// full. Wrong poses, wrong depth and wrong intrinsics of single views all show; an error that all
/// views share does not.
///
/// Views without depth are passed over. Throws Error when fewer than 2 have depth.
CrossDepthReport CrossDepth(std::span<const View* const> views,
                            const CrossDepthOptions& options = {});

/// Depth map of a view whose pixels are not in memory; called from several threads.
using DepthLoader = std::function<DepthImage(const View&)>;

/// The same of views that all have depth, which `load` brings when it is needed: for sets that are
/// larger than the memory.
CrossDepthReport CrossDepth(std::span<const View* const> views, const CrossDepthOptions& options,
                            const DepthLoader& load);

}  // namespace dtr::eval
