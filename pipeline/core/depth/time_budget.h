// pipeline/core/depth/time_budget.h -- settings that fit into so many seconds, picked before the
// stage.
#pragma once
#include <filesystem>
#include <span>

#include "dtr/base/progress.h"
#include "pipeline/core/depth_settings.h"
#include "stereo/engine.h"
#include "stereo/geometric_passes.h"

namespace dtr::pipeline {

/// What work costs here and now, wall-clock seconds per pixel of a view. Measured with one
/// kind of settings, from which others follow: the search costs in proportion to its neighbours and
/// its visits per pixel, a pass and the final filter in proportion to theirs.
struct ProbedCosts {
  double search_s = 0;  ///< per pixel, neighbour and visit
  double pass_s = 0;    ///< per pixel and neighbour
  double check_s = 0;   ///< per pixel and neighbour
};

/// Visits per pixel of full size that a search makes on all its levels; `levels` >= 1.
double VisitsPerPixel(int iterations, int levels);

/// Runs engine `patchmatch` on one view of the collection and its neighbours, shrunk to 384 px.
/// `view` must have neighbours. Throws as the engine does.
ProbedCosts ProbeCosts(const stereo::Collection& collection, int view);

/// Seconds that all of the views should take.
double PredictSeconds(const ProbedCosts& costs, const stereo::QualitySettings& quality,
                      std::span<const stereo::StereoView> views);

/// The settings a budget chooses among, cheapest first; presets are among them.
std::span<const stereo::QualitySettings> QualityLadder();

/// The most expensive settings of the ladder that should fit into the budget, else the cheapest;
/// what the choice gives explicitly stays.
stereo::QualitySettings PickQuality(const ProbedCosts& costs, const DepthChoice& choice,
                                    std::span<const stereo::StereoView> views);

/// Probes the first view that has neighbours, picks for choice.time_budget_s and says so in one
/// line. What was picked is kept in `record`, so that an interrupted run goes on with the same.
stereo::QualitySettings QualityWithinBudget(const stereo::Collection& collection,
                                            const DepthChoice& choice,
                                            const std::filesystem::path& record,
                                            Progress& progress);

}  // namespace dtr::pipeline
