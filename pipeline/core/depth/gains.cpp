#include "pipeline/core/depth/gains.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "dtr/exposure/estimate_gains.h"
#include "dtr/io/set_io.h"
#include "pipeline/core/depth/source_scene.h"
#include "pipeline/core/run/side_by_side.h"

namespace dtr::pipeline {
namespace {

constexpr int kPartners = 8;

}  // namespace

void SetGains(DtrSet& set, const SparseScene& sources_scene, const std::filesystem::path& folder,
              double memory_gb, Progress& progress) {
  std::vector<View>& views = set.frames.front().views;
  std::vector<int> sources;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].role == ViewRole::kSource) sources.push_back(static_cast<int>(i));
  }
  std::vector<SmallView> small(sources.size());
  ForViews(views, sources, "", memory_gb, progress, [&](size_t k) {
    small[k] = ShrinkForGains(Loaded(views[static_cast<size_t>(sources[k])], folder));
  });
  const auto partners = NeighboursOf(views, sources, sources_scene, kPartners);
  const std::vector<Eigen::Vector3d> gains = EstimateGains(small, partners);
  double most = 1;
  for (size_t i = 0; i < sources.size(); ++i) {
    views[static_cast<size_t>(sources[i])].gain = gains[i];
    most = std::max({most, gains[i].maxCoeff(), 1 / gains[i].minCoeff()});
  }
  if (most > 1) {
    progress.Note(fmt::format(
        "exposures of the photos differ, by up to {:.0f} % from their mean; images are blended in "
        "the exposure of the nearest ones",
        100 * (most - 1)));
  }
}

}  // namespace dtr::pipeline
