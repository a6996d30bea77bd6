#include "pipeline/detail/depth/gains.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "dtr/exposure/estimate_gains.h"
#include "dtr/io/set_io.h"
#include "pipeline/detail/depth/source_scene.h"

namespace dtr::pipeline {
namespace {

constexpr int kPartners = 8;

}  // namespace

void SetGains(DtrSet& set, const SparseScene& sources_scene, const std::filesystem::path& folder,
              int threads, Progress& progress) {
  std::vector<View>& views = set.frames.front().views;
  std::vector<int> sources;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].role == ViewRole::kSource) sources.push_back(static_cast<int>(i));
  }
  std::vector<SmallView> small;
  for (const int source : sources) {
    View loaded = views[static_cast<size_t>(source)];
    io::LoadOptions load;
    load.sigma = false;
    load.threads = threads;
    io::LoadPixels(folder, loaded, load);
    small.push_back(ShrinkForGains(loaded));
  }
  const auto partners = NeighboursOf(views, sources, sources_scene, kPartners);
  const std::vector<Eigen::Vector3d> gains = EstimateGains(small, partners, threads);
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
