// dtr/eval/growth.h -- how the time of a frame grows with what is asked for.
#pragma once
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/timed_renderer.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr::eval {

struct GrowthOptions {
  RenderOptions render;  ///< views: K wherever it is not what grows
  int repeats = 10;
};

struct GrowthRow {
  double value = 0;  ///< of what grows
  Times frame, cpu;  ///< drawing alone
};

/// Frames that differ in one thing only.
struct GrowthSeries {
  std::string axis;  ///< "views_used", "pixels" (output, megapixels) or "views_in_set"
  std::vector<GrowthRow> rows;
  /// The largest factor in time between any two rows, divided by the factor in value for the first
  /// two axes (1: linear; a fixed cost per frame makes it less) and as it is for the number of
  /// views in the set. By the GPU's clock, else by processor time.
  double worst_growth = 0;
};

/// Draws the frame of `novel` with 1...16 views (as many as are valid), at a quarter to four times
/// its pixels, and from sets of 4...256 views with four of them used: those of `set` and, when it
/// has fewer, copies of its cameras turned about the scene's centre, valid but too far off to be
/// used. Where the per-pixel rule (SPEC 1.3) draws every view of a set, there are no copies, and
/// the series ends with the views there are. The repeats run through all rows of a series in turn,
/// so that what else the machine does meets all alike. Throws UsageError when no view is valid for
/// the camera.
std::vector<GrowthSeries> MeasureGrowth(const DtrSet& set, const NovelCamera& novel,
                                        const GrowthOptions& options, TimedRenderer& renderer,
                                        Progress& progress);

}  // namespace dtr::eval
