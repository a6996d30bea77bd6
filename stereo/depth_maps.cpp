#include "stereo/depth_maps.h"

#include <algorithm>
#include <optional>
#include <string>

#include "dtr/base/parallel_for.h"
#include "stereo/rounds.h"

namespace dtr::stereo {
namespace {

/// Everything a run over a collection keeps between views.
class Run {
 public:
  Run(std::span<const StereoView> views, const SparseScene& scene, const Engine& engine,
      const DepthMapsOptions& options, Progress& progress)
      : views_(views),
        engine_(engine),
        options_(options),
        progress_(progress),
        neighbours_(ChooseNeighbours(views, scene, options.neighbours)),
        ranges_(options.given_ranges.empty() ? DepthRangesFromPoints(views, scene, options.range)
                                             : options.given_ranges),
        raw_(views.size()),
        waiting_(views.size(), 0) {
    if (ranges_.size() != views.size()) {
      throw UsageError("depth ranges: expected one per view (" + std::to_string(views.size()) +
                       "), found " + std::to_string(ranges_.size()));
    }
  }

  void Compute(const std::function<bool(int)>& already_done,
               const std::function<void(int, DepthEstimate&&, const DepthRange&)>& on_view) {
    const std::vector<int> wanted = Wanted(already_done);
    const std::vector<int> needed = Needed(wanted);
    if (engine_.Rounds() > 0) RunRounds(Together(), needed, Planes(), progress_);
    progress_.Stage("depth", static_cast<int>(needed.size()));
    // A view's pairs fill so many threads; with more, several views run side by side.
    const int threads = ResolveThreads(options_.engine.threads);
    const int side_by_side =
        engine_.Rounds() > 0 ? 1 : std::max(1, threads / std::max(1, options_.neighbours.count));
    size_t done = 0, next_wanted = 0;
    while (done < needed.size()) {
      progress_.ThrowIfInterrupted();
      const int batch = std::min(side_by_side, static_cast<int>(needed.size() - done));
      EstimateBatch({needed.data() + done, static_cast<size_t>(batch)}, threads / batch);
      done += static_cast<size_t>(batch);
      while (next_wanted < wanted.size() && Ready(wanted[next_wanted])) {
        const int view = wanted[next_wanted++];
        on_view(view, Final(view), ranges_[static_cast<size_t>(view)]);
        Release(view);
      }
      progress_.Update(static_cast<int>(done));
    }
  }

 private:
  bool Filters() const { return options_.consistency.min_agreeing > 0; }
  const std::vector<int>& NeighboursOf(int view) const {
    return neighbours_[static_cast<size_t>(view)].views;
  }
  std::optional<DepthEstimate>& Raw(int view) { return raw_[static_cast<size_t>(view)]; }

  std::vector<int> Wanted(const std::function<bool(int)>& already_done) const {
    std::vector<int> wanted;
    for (int v = 0; v < static_cast<int>(views_.size()); ++v) {
      if (!already_done || !already_done(v)) wanted.push_back(v);
    }
    return wanted;
  }

  /// The wanted views and, when filtering, their neighbours; counts who waits for each raw map.
  std::vector<int> Needed(const std::vector<int>& wanted) {
    for (const int v : wanted) {
      ++waiting_[static_cast<size_t>(v)];
      if (!Filters()) continue;
      for (const int n : NeighboursOf(v)) ++waiting_[static_cast<size_t>(n)];
    }
    std::vector<int> needed;
    for (int v = 0; v < static_cast<int>(views_.size()); ++v) {
      if (waiting_[static_cast<size_t>(v)] > 0) needed.push_back(v);
    }
    return needed;
  }

  void EstimateBatch(std::span<const int> batch, int threads_each) {
    EngineOptions engine_options = options_.engine;
    engine_options.threads = std::max(1, threads_each);
    engine_options.memory_gb /= static_cast<double>(batch.size());
    const int at_once = static_cast<int>(batch.size());
    ParallelFor(0, at_once, at_once, [&](int i) {
      const int view = batch[static_cast<size_t>(i)];
      Raw(view) = EstimateOne(view, engine_options);
    });
  }

  Collection Together() const { return {views_, neighbours_, ranges_, &engine_, options_.engine}; }
  PlaneMapStore& Planes() { return options_.planes != nullptr ? *options_.planes : in_memory_; }

  DepthEstimate EstimateOne(int view, const EngineOptions& engine_options) {
    const PinholeCamera& camera = views_[static_cast<size_t>(view)].camera;
    const auto holes = [&] {
      return DepthEstimate{DepthImage(camera.width_px(), camera.height_px()),
                           Grid<float>(camera.width_px(), camera.height_px())};
    };
    if (engine_.Rounds() > 0) {
      // Stores belong to one thread; batches of engines with rounds are of one view.
      const PlanesAround around(Together(), Planes(), engine_.Rounds(), view);
      if (!around.HasOwn()) return holes();
      return engine_.Judge(views_, view, NeighboursOf(view), ranges_[static_cast<size_t>(view)],
                           around.maps(), engine_options);
    }
    if (NeighboursOf(view).empty()) {
      progress_.Note("view " + std::to_string(view) + ": no neighbours, no depth");
      return holes();
    }
    try {
      return engine_.Estimate(views_, view, NeighboursOf(view), ranges_[static_cast<size_t>(view)],
                              engine_options);
    } catch (const NoUsablePair& error) {
      progress_.Note(std::string(error.what()) + ": no depth");
      return holes();
    }
  }

  bool Ready(int view) {
    if (!Raw(view)) return false;
    return !Filters() || std::all_of(NeighboursOf(view).begin(), NeighboursOf(view).end(),
                                     [&](int n) { return Raw(n).has_value(); });
  }

  DepthEstimate Final(int view) {
    if (!Filters()) return *Raw(view);
    std::vector<OtherDepth> others;
    for (const int n : NeighboursOf(view)) {
      others.push_back({&views_[static_cast<size_t>(n)], &*Raw(n)});
    }
    return FilterByConsistency(views_[static_cast<size_t>(view)], *Raw(view), others,
                               options_.consistency, options_.engine.threads);
  }

  /// Drops raw maps nobody waits for any more.
  void Release(int view) {
    const auto drop = [&](int v) {
      if (--waiting_[static_cast<size_t>(v)] == 0) Raw(v).reset();
    };
    if (Filters()) std::for_each(NeighboursOf(view).begin(), NeighboursOf(view).end(), drop);
    drop(view);
  }

  std::span<const StereoView> views_;
  const Engine& engine_;
  const DepthMapsOptions& options_;
  Progress& progress_;
  std::vector<ViewNeighbours> neighbours_;
  std::vector<DepthRange> ranges_;
  PlaneMapsInMemory in_memory_;
  std::vector<std::optional<DepthEstimate>> raw_;  ///< unfiltered maps still waited for
  std::vector<int> waiting_;                       ///< how many results still need each of them
};

}  // namespace

void ComputeDepthMaps(
    std::span<const StereoView> views, const SparseScene& scene, const Engine& engine,
    const DepthMapsOptions& options, Progress& progress,
    const std::function<bool(int view)>& already_done,
    const std::function<void(int view, DepthEstimate&&, const DepthRange&)>& on_view) {
  Run(views, scene, engine, options, progress).Compute(already_done, on_view);
}

}  // namespace dtr::stereo
