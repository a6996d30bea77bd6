#include "stereo/sgbm/sgbm_engine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "stereo/sgbm/fuse.h"
#include "stereo/sgbm/planes.h"

namespace dtr::stereo {
namespace {

/// Connected areas smaller than this share of the image are taken for chance matches: about 60
/// pixels at 960x640. Pixels connect across at most this many pixels of disparity.
constexpr double kSgbmSpeckleShare = 1e-4;
constexpr double kSpeckleSteps = 2.0;

/// The coarse pass that looks for large planes: long side of the image, pairs used, slopes tried
/// (px of disparity per row; the ground under a camera rises by baseline / height above it).
constexpr double kCoarseSidePx = 256;
constexpr size_t kCoarsePairs = 3;
constexpr double kCoarseSlopes[] = {0, -0.7, 0.7, -1.4, 1.4};
/// Slopes below this are matched well by the sweep that faces the camera.
constexpr double kSteepSlope = 0.2;
/// Disparities searched around a plane: 24 on either side.
constexpr int kPlaneSteps = 48;

/// Sweeps around planes have few disparities, so nothing forces them to a lower resolution.
constexpr PairLimits kFineLimits{.scale = 1.0,
                                 .max_disparities = std::numeric_limits<int>::max(),
                                 .max_volume = std::numeric_limits<std::int64_t>::max()};

/// A usable pair: how it is rectified, and the neighbour.
struct Pair {
  RectifiedPair whole;  ///< coarse enough to search the whole range
  RectifiedPair fine;   ///< at the reference's resolution, for sweeps around planes
  const StereoView* neighbour;
};

/// StereoSGBM in full mode keeps two 16-bit numbers per pixel and disparity.
constexpr double kBytesPerCell = 4;

/// Pairs that may be matched at the same time within the memory given; at least one.
int PairsAtOnce(const std::vector<Pair>& pairs, const EngineOptions& options) {
  double largest = 1;
  for (const Pair& pair : pairs) {
    const RectifiedPair& p = pair.whole;
    largest = std::max(
        largest, kBytesPerCell * p.camera.width_px() * p.camera.height_px() * p.FullSweep(0).steps);
  }
  return static_cast<int>(std::clamp(options.memory_gb * kBytesPerGigabyte / largest, 1.0, 1e6));
}

void CheckSgbmRequest(std::span<const StereoView> views, int reference,
                      std::span<const int> neighbours, const DepthRange& range) {
  const auto exists = [&](int i) { return i >= 0 && static_cast<size_t>(i) < views.size(); };
  for (const int n : neighbours) {
    if (!exists(n) || n == reference) throw std::invalid_argument("Estimate: no such neighbour");
  }
  if (!exists(reference)) throw std::invalid_argument("Estimate: no such reference view");
  if (!(range.near_z > 0) || !(range.far_z > range.near_z) || !std::isfinite(range.far_z)) {
    throw Error("view " + std::to_string(reference) +
                ": depth range, expected 0 < near < far, found " + std::to_string(range.near_z) +
                " to " + std::to_string(range.far_z));
  }
}

/// One run of the matcher.
struct Task {
  int pair;
  const RectifiedPair* rectified;
  Sweep sweep;
};

/// The large slanted planes of the reference view, from a coarse pass over several slopes.
std::vector<Eigen::Vector3d> FindPlanes(const StereoView& reference, const GreyImage& picture,
                                        const std::vector<Pair>& pairs,
                                        const std::vector<GreyImage>& pictures,
                                        const DepthRange& range, const PairLimits& limits) {
  const PinholeCamera& camera = reference.camera;
  PairLimits coarse = limits;
  coarse.scale = std::min(1.0, kCoarseSidePx / std::max(camera.width_px(), camera.height_px()));
  const PinholeCamera grid =
      camera.Resized(std::max(1, static_cast<int>(camera.width_px() * coarse.scale)),
                     std::max(1, static_cast<int>(camera.height_px() * coarse.scale)));
  std::vector<RectifiedPair> rectified;
  rectified.reserve(kCoarsePairs);
  std::vector<Task> tasks;
  for (size_t i = 0; i < std::min(kCoarsePairs, pairs.size()); ++i) {
    std::string rejection;
    const auto pair = RectifyPair(reference, *pairs[i].neighbour, range, coarse, &rejection);
    if (!pair) return {};
    rectified.push_back(*pair);
    for (const double slope : kCoarseSlopes) {
      tasks.push_back({static_cast<int>(i), &rectified.back(), pair->FullSweep(slope)});
    }
  }
  std::vector<PairDepth> sweeps(tasks.size());
  ParallelFor(0, static_cast<int>(tasks.size()), [&](int i) {
    const Task& task = tasks[static_cast<size_t>(i)];
    const auto k = static_cast<size_t>(task.pair);
    sweeps[static_cast<size_t>(i)] =
        MatchPair(picture, pictures[k], *task.rectified, task.sweep, grid);
    sweeps[static_cast<size_t>(i)].pair = task.pair;
  });
  const DepthEstimate map =
      FusePairs(grid, nullptr, sweeps, static_cast<int>(rectified.size()), range);
  return DominantPlanes(map.depth, grid, sweeps.front().step_from_ray, {});
}

/// The sweep that faces the camera for every pair, and one around each plane that is steep for it.
std::vector<Task> TasksOf(const std::vector<Pair>& pairs,
                          const std::vector<Eigen::Vector3d>& planes) {
  std::vector<Task> tasks;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const int pair = static_cast<int>(i);
    tasks.push_back({pair, &pairs[i].whole, pairs[i].whole.FullSweep(0)});
    for (const Eigen::Vector3d& n : planes) {
      const auto sweep = pairs[i].fine.SweepAround(n, kPlaneSteps);
      if (sweep && std::hypot(sweep->plane.x(), sweep->plane.y()) >= kSteepSlope) {
        tasks.push_back({pair, &pairs[i].fine, *sweep});
      }
    }
  }
  return tasks;
}

}  // namespace

DepthEstimate SgbmEngine::Estimate(std::span<const StereoView> views, int reference,
                                   std::span<const int> neighbours, const DepthRange& range,
                                   const EngineOptions& options) const {
  CheckSgbmRequest(views, reference, neighbours, range);
  const StereoView& view = views[static_cast<size_t>(reference)];
  std::vector<Pair> pairs;
  std::string reasons;
  for (const int n : neighbours) {
    std::string rejection;
    const StereoView& other = views[static_cast<size_t>(n)];
    const auto whole = RectifyPair(view, other, range, limits_, &rejection);
    const auto fine = RectifyPair(view, other, range, kFineLimits, &rejection);
    if (whole && fine) {
      pairs.push_back({*whole, *fine, &other});
    } else {
      reasons += "; with view " + std::to_string(n) + ": " + rejection;
    }
  }
  if (pairs.empty()) {
    throw NoUsablePair("view " + std::to_string(reference) + ": no usable stereo pair among " +
                       std::to_string(neighbours.size()) + " neighbours" + reasons);
  }

  const GreyImage picture = MakeGreyImage(view);
  std::vector<GreyImage> pictures;
  for (const Pair& pair : pairs) pictures.push_back(MakeGreyImage(*pair.neighbour));
  const std::vector<Task> tasks =
      TasksOf(pairs, FindPlanes(view, picture, pairs, pictures, range, limits_));
  std::vector<PairDepth> sweeps(tasks.size());
  ParallelFor(0, static_cast<int>(tasks.size()), PairsAtOnce(pairs, options), [&](int i) {
    const Task& task = tasks[static_cast<size_t>(i)];
    const auto k = static_cast<size_t>(task.pair);
    PairDepth& sweep = sweeps[static_cast<size_t>(i)];
    sweep = MatchPair(picture, pictures[k], *task.rectified, task.sweep, view.camera);
    sweep.pair = task.pair;
  });
  DepthEstimate estimate =
      FusePairs(view.camera, view.mask, sweeps, static_cast<int>(pairs.size()), range);
  const int min_pixels = static_cast<int>(kSgbmSpeckleShare * view.camera.width_px() *
                                          static_cast<double>(view.camera.height_px()));
  RemoveSpeckles(view.camera, sweeps, min_pixels, kSpeckleSteps, &estimate);
  return estimate;
}

}  // namespace dtr::stereo
