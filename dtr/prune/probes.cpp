#include "dtr/prune/probes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/base/random.h"

namespace dtr::prune {
namespace {

constexpr size_t kNeighbours = 4;                    // as reference_baseline counts them
constexpr double kNearest = 0.25, kFarthest = 0.75;  // share of the way; else an input's own place

std::vector<const View*> Sources(const DtrSet& set) {
  std::vector<const View*> sources;
  if (!set.frames.empty()) {
    for (const View& view : set.frames.front().views) {
      if (view.role == ViewRole::kSource) sources.push_back(&view);
    }
  }
  std::sort(sources.begin(), sources.end(),
            [](const View* a, const View* b) { return a->id < b->id; });
  if (sources.size() < 2) {
    throw Error("pruning: expected at least 2 source views to look between, found " +
                std::to_string(sources.size()));
  }
  return sources;
}

/// Nearest first, ties by id.
std::vector<const View*> NeighboursOf(const View& view, std::vector<const View*> sources) {
  const Eigen::Vector3d center = view.CenterInWorld();
  std::erase(sources, &view);
  std::stable_sort(sources.begin(), sources.end(), [&](const View* a, const View* b) {
    return (a->CenterInWorld() - center).squaredNorm() <
           (b->CenterInWorld() - center).squaredNorm();
  });
  sources.resize(std::min(sources.size(), kNeighbours));
  return sources;
}

NovelCamera Between(const View& a, const View& b, double share) {
  NovelCamera novel{a.camera, {}};
  const Eigen::Vector3d center = (1 - share) * a.CenterInWorld() + share * b.CenterInWorld();
  novel.cam_from_world.rotation =
      a.cam_from_world.rotation.slerp(share, b.cam_from_world.rotation).normalized();
  novel.cam_from_world.translation = -(novel.cam_from_world.rotation * center);
  return novel;
}

}  // namespace

std::vector<NovelCamera> DrawProbes(const DtrSet& set, int count, std::uint64_t seed) {
  const std::vector<const View*> sources = Sources(set);
  std::vector<NovelCamera> cameras;
  for (int i = 0; i < count; ++i) {
    Random random(HashOf(seed, static_cast<std::uint64_t>(i)));
    const auto n = static_cast<size_t>((i + 0.5) / count * static_cast<double>(sources.size()));
    const View& view = *sources[n % sources.size()];
    const auto near = NeighboursOf(view, sources);
    const auto partner = static_cast<size_t>(random.Index(static_cast<int>(near.size())));
    cameras.push_back(Between(view, *near[partner], random.Uniform(kNearest, kFarthest)));
  }
  return cameras;
}

}  // namespace dtr::prune
