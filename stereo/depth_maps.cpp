#include "stereo/depth_maps.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>

#include "dtr/base/parallel_for.h"
#include "stereo/geometric_passes.h"
#include "stereo/left_out.h"
#include "stereo/side_by_side.h"
#include "stereo/time_step.h"
#include "stereo/widen.h"

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
        pages_(options.memory_bytes > 0 ? options.memory_bytes
                                        : std::numeric_limits<std::uint64_t>::max()),
        planes_(options.planes != nullptr ? *options.planes : planes_in_memory_, pages_, views),
        estimates_(options.estimates != nullptr ? *options.estimates : estimates_in_memory_, pages_,
                   views),
        waiting_(views.size(), 0) {
    if (ranges_.size() != views.size()) {
      throw UsageError("depth ranges: expected one per view (" + std::to_string(views.size()) +
                       "), found " + std::to_string(ranges_.size()));
    }
  }

  std::vector<DepthRange> Ranges() { return Widened(Together(), options_.widenings, progress_); }

  void Pass(int pass, const std::function<bool(int)>& already_done) {
    const std::vector<int> wanted = Wanted(already_done);
    Begin(wanted);
    RunPass(Together(), wanted, planes_, pass, progress_);
  }

  void Maps(const std::function<bool(int)>& already_done,
            const std::function<void(int, DepthEstimate&&, const DepthRange&)>& on_view) {
    const std::vector<int> wanted = Wanted(already_done), needed = Begin(wanted);
    if (options_.has_passes) {
      RequirePass(Together(), needed, planes_, engine_.Passes());
    } else if (engine_.Passes() > 0) {
      RunAllPasses(Together(), needed, planes_, progress_);
    }
    progress_.Stage("depth", static_cast<int>(needed.size()));
    const int at_once = AtOnce(needed);
    const int without_planes_before = WithoutPlanes();
    size_t done = 0, next_wanted = 0;
    while (done < needed.size()) {
      const size_t batch = std::min(static_cast<size_t>(at_once), needed.size() - done);
      EstimateBatch({needed.data() + done, batch});
      done += batch;
      const size_t first = next_wanted;
      while (next_wanted < wanted.size() && Ready(wanted[next_wanted])) ++next_wanted;
      ParallelFor(static_cast<int>(first), static_cast<int>(next_wanted), at_once, [&](int k) {
        const int view = wanted[static_cast<size_t>(k)];
        on_view(view, Final(view), ranges_[static_cast<size_t>(view)]);
      });
      for (size_t k = first; k < next_wanted; ++k) Release(wanted[k]);
      progress_.Update(static_cast<int>(done));
    }
    if (const int without = WithoutPlanes() - without_planes_before; without > 0) {
      progress_.Note("planes on weak texture left out in " + std::to_string(without) + " of " +
                     std::to_string(needed.size()) + " views: their texture suffices");
    }
  }

 private:
  /// Before any work on `wanted`. Returns all views that it needs.
  std::vector<int> Begin(const std::vector<int>& wanted) {
    std::vector<int> needed = Needed(wanted);
    CheckMemory(needed);
    // All of them: passes also match what is not needed itself, and must do so alike every time.
    if (!needed.empty()) TellStrangers();
    if (!needed.empty()) ranges_ = Ranges();
    return needed;
  }
  /// Of an engine that does not say what it takes one at a time within a limit; without one, as
  /// many as threads are left over by a view's pairs.
  int AtOnce(const std::vector<int>& views) {
    const int at_once = ViewsAtOnce(Together(), views, Filters());
    if (at_once > 1 || Limited()) return at_once;
    return std::max(1, ThreadLimit::Current() / std::max(1, options_.neighbours.count));
  }
  bool Limited() const { return options_.memory_bytes > 0 || options_.load_pixels != nullptr; }
  bool Filters() const { return options_.consistency.min_agreeing > 0; }
  const std::vector<int>& NeighboursOf(int view) const {
    return neighbours_[static_cast<size_t>(view)].views;
  }

  int WithoutPlanes() const {
    const auto* counts = dynamic_cast<const CountsLeftOut*>(&engine_);
    return counts != nullptr ? counts->without_planes() : 0;
  }

  void TellStrangers() {
    size_t strangers = 0;
    for (const ViewNeighbours& view : neighbours_) strangers += static_cast<size_t>(view.strangers);
    if (strangers == 0) return;
    progress_.Note(std::to_string(strangers) + " of " +
                   std::to_string(views_.size() * (views_.size() - 1)) +
                   " pairs of view and neighbour left out: they have no more than 3 points in "
                   "common");
  }

  void CheckMemory(const std::vector<int>& needed) const {
    if (options_.memory_bytes == 0) return;
    std::uint64_t least = 0;
    for (const int v : needed) {
      least = std::max(least, LeastBytes(views_, engine_, v, NeighboursOf(v),
                                         static_cast<bool>(options_.load_pixels), Filters()));
    }
    if (least <= options_.memory_bytes) return;
    throw NotEnoughMemory("depth maps: expected memory of at least " + std::to_string(least) +
                              " bytes, found " + std::to_string(options_.memory_bytes),
                          least);
  }

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

  void EstimateBatch(std::span<const int> batch) {
    EngineOptions engine_options = options_.engine;
    engine_options.memory_gb /= static_cast<double>(batch.size());
    std::vector<std::string> notes(batch.size());
    const auto count = static_cast<int>(batch.size());
    ParallelFor(0, count, [&](int i) {
      progress_.ThrowIfInterrupted();
      const auto k = static_cast<size_t>(i);
      estimates_.Save(batch[k], EstimateOne(batch[k], engine_options, &notes[k]));
    });
    for (const std::string& note : notes) {
      if (!note.empty()) progress_.Note(note);
    }
  }

  Collection Together() {
    return {views_, neighbours_, ranges_, &engine_, options_.engine, options_.load_pixels, &pages_};
  }

  DepthEstimate EstimateOne(int view, const EngineOptions& engine_options, std::string* note) {
    const PinholeCamera& camera = views_[static_cast<size_t>(view)].camera;
    const auto holes = [&] {
      return DepthEstimate{DepthImage(camera.width_px(), camera.height_px()),
                           Grid<float>(camera.width_px(), camera.height_px())};
    };
    if (engine_.Passes() > 0) {
      const PlanesAround around(Together(), planes_, engine_.Passes(), view);
      if (!around.HasOwn()) return holes();
      const Room room(Together(), view);
      return engine_.Filter(room.views(), view, NeighboursOf(view),
                            ranges_[static_cast<size_t>(view)], around.maps(), engine_options);
    }
    if (NeighboursOf(view).empty()) {
      *note = "view " + std::to_string(view) + ": no neighbours, no depth";
      return holes();
    }
    try {
      const Room room(Together(), view);
      return engine_.Estimate(room.views(), view, NeighboursOf(view),
                              ranges_[static_cast<size_t>(view)], engine_options);
    } catch (const NoUsablePair& error) {
      *note = std::string(error.what()) + ": no depth";
      return holes();
    }
  }

  bool Ready(int view) {
    if (!estimates_.Has(view)) return false;
    return !Filters() || std::all_of(NeighboursOf(view).begin(), NeighboursOf(view).end(),
                                     [&](int n) { return estimates_.Has(n); });
  }

  DepthEstimate Final(int view) {
    const std::shared_ptr<const DepthEstimate> own = estimates_.Load(view);
    if (!Filters()) return *own;
    std::vector<std::shared_ptr<const DepthEstimate>> held;
    std::vector<OtherDepth> others;
    for (const int n : NeighboursOf(view)) {
      held.push_back(estimates_.Load(n));
      others.push_back({&views_[static_cast<size_t>(n)], held.back().get()});
    }
    // What makes room here also leaves it for writing the result.
    const StereoView& of = views_[static_cast<size_t>(view)];
    const Pages::Reservation result(pages_,
                                    kResultCopies * EstimateBytes(of.camera) + OtherBytes(of));
    const auto time_step = of.time_step != nullptr ? of.time_step->load() : nullptr;
    return FilterByConsistency(of, *own, others, options_.consistency,
                               time_step ? &time_step->open : nullptr);
  }

  /// Drops raw maps nobody waits for any more.
  void Release(int view) {
    const auto drop = [&](int v) {
      if (--waiting_[static_cast<size_t>(v)] == 0) estimates_.Drop(v);
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
  Pages pages_;
  PlaneMapsInMemory planes_in_memory_;
  EstimatesInMemory estimates_in_memory_;
  PagedPlanes planes_;
  PagedEstimates estimates_;  ///< unfiltered maps still waited for
  std::vector<int> waiting_;  ///< how many results still need each of them
};

}  // namespace

std::vector<DepthRange> WidenedRanges(std::span<const StereoView> views, const SparseScene& scene,
                                      const Engine& engine, const DepthMapsOptions& options,
                                      Progress& progress) {
  return Run(views, scene, engine, options, progress).Ranges();
}

void ComputeDepthMaps(
    std::span<const StereoView> views, const SparseScene& scene, const Engine& engine,
    const DepthMapsOptions& options, Progress& progress,
    const std::function<bool(int view)>& already_done,
    const std::function<void(int view, DepthEstimate&&, const DepthRange&)>& on_view) {
  Run(views, scene, engine, options, progress).Maps(already_done, on_view);
}

void ComputeDepthPass(std::span<const StereoView> views, const SparseScene& scene,
                      const Engine& engine, const DepthMapsOptions& options, int pass,
                      Progress& progress, const std::function<bool(int view)>& already_done) {
  Run(views, scene, engine, options, progress).Pass(pass, already_done);
}

}  // namespace dtr::stereo
