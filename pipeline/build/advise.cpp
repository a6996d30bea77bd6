#include "pipeline/build/advise.h"

#include <fmt/format.h>

#include <algorithm>

#include "dtr/io/set_io.h"
#include "pipeline/core/run/side_by_side.h"

namespace dtr::pipeline {

std::vector<advise::CoarseView> CoarseViewsOf(const std::filesystem::path& folder,
                                              const DtrSet& set, double memory_gb,
                                              Progress& progress) {
  const auto& views = set.frames.front().views;
  const std::vector<int> which = ViewsWithDepth(views);
  std::vector<advise::CoarseView> coarse(which.size());
  ForViews(views, which, "reading depth", memory_gb, progress, [&](size_t k) {
    const View loaded = Loaded(views[static_cast<size_t>(which[k])], folder, {.images = false});
    coarse[k] = advise::MakeCoarse(loaded, advise::kCoarseSidePx);
  });
  return coarse;
}

std::vector<std::string> AdviceLines(const advise::Advice& advice) {
  const auto poor = std::ranges::count_if(advice.places, &advise::Place::poor);
  std::string missing =
      fmt::format("coverage: {} of {} positions between and beyond the cameras are poor", poor,
                  advice.places.size());
  if (!advice.add.empty()) {
    const advise::Place& place = advice.places[advice.add.front().place];
    const std::string why = advise::WhyPoor(place, {});
    missing += fmt::format("; most is gained by a camera {}{}{}", place.where,
                           why.empty() ? "" : ": ", why);
  }
  std::string redundant = "coverage: every camera shows something of its own";
  if (!advice.redundant.empty()) {
    redundant = fmt::format("coverage: {} of the cameras add nothing, first {}",
                            advice.redundant.size(), advice.redundant.front().name);
  }
  return {missing, redundant};
}

}  // namespace dtr::pipeline
