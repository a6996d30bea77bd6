#include "pipeline/detail/depth/gains.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "dtr/exposure/estimate_gains.h"
#include "dtr/io/set_io.h"
#include "stereo/neighbours.h"

namespace dtr::pipeline {
namespace {

constexpr int kPartners = 8;

}  // namespace

void SetGains(DtrSet& set, const SparseScene& sources_scene, const std::filesystem::path& folder,
              int threads, Progress& progress) {
  std::vector<View*> sources;
  std::vector<stereo::StereoView> cameras;
  for (View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    sources.push_back(&view);
    cameras.push_back({view.camera, view.cam_from_world, nullptr, nullptr});
  }
  std::vector<SmallView> small;
  for (const View* source : sources) {
    View loaded = *source;
    io::LoadOptions load;
    load.sigma = false;
    load.threads = threads;
    io::LoadPixels(folder, loaded, load);
    small.push_back(ShrinkForGains(loaded));
  }
  stereo::NeighbourOptions options;
  options.count = kPartners;
  std::vector<std::vector<int>> partners;
  for (auto& neighbours : stereo::ChooseNeighbours(cameras, sources_scene, options)) {
    partners.push_back(std::move(neighbours.views));
  }
  const std::vector<Eigen::Vector3d> gains = EstimateGains(small, partners, threads);
  double most = 1;
  for (size_t i = 0; i < sources.size(); ++i) {
    sources[i]->gain = gains[i];
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
