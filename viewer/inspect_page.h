// viewer/inspect_page.h -- one offline page that says what is good and what is bad in a set.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/render/options.h"
#include "dtr/render/view_stream.h"
#include "dtr/report/html.h"
#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"

namespace dtr::viewer {

/// What a stage of the build cost.
struct StageCost {
  std::string name;
  double wall_s = 0, cpu_s = 0, peak_bytes = 0;
};

/// Everything but the views' pixels.
struct InspectFacts {
  std::string name;
  std::vector<Check> checks;               ///< the set's validation result; empty: not validated
  std::map<std::string, double> error_px;  ///< held-out reprojection RMS by view name
  double error_limit_px = 0;               ///< above it a view is bad
  std::vector<StageCost> stages;
  std::function<void(report::HtmlReport&)>
      add_further;  ///< sections of its own, last; may be empty
  /// A view with its image, depth and sigma.
  std::function<View(const View&)> load;
};

/// The page. Views are rendered without their own photo by the reference renderer, small: what a
/// set is worth where it has no photo. Pixels come one view at a time from `facts.load`, and from
/// `stream`, which is of `set`. Deterministic but for what `facts` holds.
std::string InspectPage(const DtrSet& set, ViewStream& stream, const InspectFacts& facts,
                        const RenderOptions& options, Progress& progress);

}  // namespace dtr::viewer
