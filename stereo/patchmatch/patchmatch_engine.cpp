#include "stereo/patchmatch/patchmatch_engine.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>

#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"
#include "stereo/patchmatch/depth_filter.h"
#include "stereo/patchmatch/expected.h"
#include "stereo/patchmatch/hypotheses.h"
#include "stereo/patchmatch/level.h"
#include "stereo/prior_use.h"
#include "stereo/time_step.h"

namespace dtr::stereo {
namespace {

using namespace patchmatch;

/// Long side of the coarsest level, at most this; and the short side never falls below the least.
constexpr int kCoarsestSidePx = 256;
constexpr int kSmallestSidePx = 24;
/// The first guess tries one inverse depth per pixel of disparity, within these bounds.
constexpr double kMinSamples = 48, kMaxSamples = 128;
/// Visits per pixel on the coarsest level more than on those between, and on the finest fewer.
constexpr int kMoreIterations = 2;
constexpr float kFirstStepPx = 4.0f, kFinestStepPx = 1.0f;
/// In the place of QualitySettings::iterations where the result is only looked at.
constexpr int kLookIterations = 1;
/// Visits per pixel in each pass of geometric consistency.
constexpr int kRefineIterations = 1;
/// Visits per open pixel that begins with its plane of the time step before.
constexpr int kFollowIterations = 3;
/// Open pixels whose followed plane costs more than this are searched for from nothing.
constexpr float kLostCost = 0.5f;
constexpr int kFollowPassNumber = 500;  // names its random numbers apart from the search's
constexpr int kFirstPassNumber = 1000;  // names random numbers apart from the search's
/// A pair whose rays to the middle of the range meet at less than this has no baseline.
constexpr double kSmallestDisparityPx = 0.5;

/// Bytes per pixel: the reference's grey values, colours and mask; planes and costs; the weight of
/// a view; two guesses, and a grid they are made from; its image with all halvings; planes to
/// hand out; a depth map with what evaluating it takes; a neighbour's textures with all halvings.
constexpr double kReferenceBytes = 12, kStateBytes = 16, kWeightBytes = 4, kGuessBytes = 28,
                 kImageBytes = 7, kPlaneBytes = 12, kEstimateBytes = 54, kSourceBytes = 7;
/// What a view's time step takes beside TimeStepBytes: which pixels are open, suggested planes, and
/// what was found for lost ones.
constexpr double kOpenBytes = 4 + 12, kLostBytes = 1 + kPlaneBytes;
/// What a prior takes at the reference's pixels, of two levels in the search, beside PriorBytes.
constexpr double kExpectedBytes = 16;
constexpr double kSmallThingsBytes = 1 << 18;

void CheckRequest(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                  const DepthRange& range) {
  const auto exists = [&](int i) { return i >= 0 && static_cast<size_t>(i) < views.size(); };
  if (!exists(reference)) throw std::invalid_argument("Estimate: no such reference view");
  for (const int n : neighbours) {
    if (!exists(n) || n == reference) throw std::invalid_argument("Estimate: no such neighbour");
  }
  if (!(range.near_z > 0) || !(range.far_z > range.near_z) || !std::isfinite(range.far_z)) {
    throw Error("view " + std::to_string(reference) +
                ": depth range, expected 0 < near < far, found " + std::to_string(range.near_z) +
                " to " + std::to_string(range.far_z));
  }
}

/// Pixels of disparity between the ends of the range, most in any view, at the image's centre.
double RangePx(const StereoView& view, const StereoView& other, const DepthRange& range) {
  const double baseline =
      (view.cam_from_world.TargetOriginInSource() - other.cam_from_world.TargetOriginInSource())
          .norm();
  return other.camera.fx_px() * baseline * (1 / range.near_z - 1 / range.far_z);
}

/// The neighbours with a baseline, as pyramids.
std::vector<SourcePyramid> MakeSources(std::span<const StereoView> views, int reference,
                                       std::span<const int> neighbours, const DepthRange& range,
                                       std::span<const PlaneMap* const> maps, int most,
                                       int levels) {
  std::vector<int> usable;
  for (const int n : neighbours) {
    const StereoView& other = views[static_cast<size_t>(n)];
    if (RangePx(views[static_cast<size_t>(reference)], other, range) < kSmallestDisparityPx) {
      continue;
    }
    if (static_cast<int>(usable.size()) < most) usable.push_back(n);
  }
  if (usable.empty()) {
    throw NoUsablePair("view " + std::to_string(reference) + ": none of its " +
                       std::to_string(neighbours.size()) + " neighbours has a baseline");
  }
  std::vector<SourcePyramid> sources(usable.size());
  ParallelFor(0, static_cast<int>(usable.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    sources[k] = MakeSource(views[static_cast<size_t>(usable[k])], levels);
    if (!maps.empty()) sources[k].surface = maps[static_cast<size_t>(usable[k])];
  });
  return sources;
}

/// Levels until the long side is small enough, as all the images allow.
int LevelsFor(std::span<const StereoView> views, int reference, std::span<const int> neighbours) {
  const PinholeCamera& camera = views[static_cast<size_t>(reference)].camera;
  int shortest = std::min(camera.width_px(), camera.height_px());
  for (const int n : neighbours) {
    const PinholeCamera& c = views[static_cast<size_t>(n)].camera;
    shortest = std::min({shortest, c.width_px(), c.height_px()});
  }
  int levels = 1;
  while ((std::max(camera.width_px(), camera.height_px()) >> (levels - 1)) > kCoarsestSidePx &&
         (shortest >> levels) >= kSmallestSidePx) {
    ++levels;
  }
  return levels;
}

void RunSweeps(const Level& level, Sweep sweep, int iterations, float step_px, int* number,
               State* state) {
  for (int i = 0; i < iterations; ++i) {
    sweep.iteration = i;
    sweep.step_px = step_px * std::exp2(static_cast<float>(-i));
    sweep.number = (*number)++;
    for (sweep.colour = 0; sweep.colour < 2; ++sweep.colour) {
      ParallelFor(0, level.reference.height, [&](int y) { SweepRow(level, sweep, y, state); });
    }
  }
}

/// Planes of the finest level. `expect` sets what a level's pixels are expected to show.
State SearchPyramid(const StereoView& view, std::span<const GreyImage> pictures,
                    std::span<const SourcePyramid> sources, const DepthRange& range, int iterations,
                    const EngineOptions& options,
                    const std::function<void(size_t index, Level*)>& expect, Level* finest) {
  State state;
  Level level, coarser;
  int number = 0;
  // From the coarsest of at least one; left at the finest.
  for (size_t index = pictures.size() - 1;; --index, coarser = std::move(level)) {
    const std::uint64_t seed = HashOf(options.seed, index);
    level = MakeLevel(view, pictures[index], sources, index, range, seed);
    expect(index, &level);
    const bool coarsest = index + 1 == pictures.size();
    if (coarsest) {
      double range_px = 0;
      for (const SourcePyramid& s : sources) {
        range_px = std::max(range_px, RangePx(view, *s.view, range));
      }
      const double scale = std::exp2(-static_cast<double>(index));
      const int samples = static_cast<int>(std::clamp(range_px * scale, kMinSamples, kMaxSamples));
      state = EmptyState(level);
      ParallelFor(0, level.reference.height, [&](int y) { SearchRow(level, samples, y, &state); });
    } else {
      state = Upsampled(state, coarser, level);
    }
    Sweep sweep;
    sweep.jump = index > 0 || coarsest;
    const int visits = coarsest     ? iterations + kMoreIterations
                       : index == 0 ? std::max(1, iterations - kMoreIterations)
                                    : iterations;
    RunSweeps(level, sweep, visits, coarsest ? kFirstStepPx : kFinestStepPx * 2, &number, &state);
    if (index == 0) break;
  }
  *finest = std::move(level);
  return state;
}

/// Open pixels whose plane the photos do not support.
Mask LostPixels(const Level& level, const State& state, const Mask& open) {
  Mask lost(open.width(), open.height());
  for (int y = 0; y < level.reference.height; ++y) {
    for (int x = 0; x < level.reference.width; ++x) {
      if (open(x, y) != 0 && !(*state.cost.at(x, y) <= kLostCost)) lost(x, y) = 255;
    }
  }
  return lost;
}

/// Takes what was found for lost pixels where it costs less.
void TakeCheaper(const State& found, const Mask& lost, State* state) {
  for (int y = 0; y < lost.height(); ++y) {
    for (int x = 0; x < lost.width(); ++x) {
      if (lost(x, y) == 0 || !(*found.cost.at(x, y) < *state->cost.at(x, y))) continue;
      *state->w.at(x, y) = *found.w.at(x, y);
      *state->a.at(x, y) = *found.a.at(x, y);
      *state->b.at(x, y) = *found.b.at(x, y);
      *state->cost.at(x, y) = *found.cost.at(x, y);
    }
  }
}

/// What is matched with what, at all sizes.
struct Problem {
  Problem(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
          const DepthRange& depth_range, std::span<const PlaneMap* const> maps, int max_sources)
      : view(&views[static_cast<size_t>(reference)]), range(depth_range) {
    CheckRequest(views, reference, neighbours, range);
    const int levels = maps.empty() ? LevelsFor(views, reference, neighbours) : 1;
    pictures = Pyramid(MakeGreyImage(*view), levels);
    sources = MakeSources(views, reference, neighbours, range, maps, max_sources, levels);
    if (view->prior != nullptr) prior.emplace(view->prior->load());
    if (view->time_step != nullptr) time_step = view->time_step->load();
  }

  /// What is known of a level's pixels beside the photos.
  void Expect(size_t index, const Mask* open, Level* level) const {
    if (prior) level->expected = ExpectedOf(*level, *prior, view->prior->noise, range);
    if (open != nullptr) level->open = OpenPixels(*level, *open, 1 << index);
  }
  const Mask* Open() const { return time_step ? &time_step->open : nullptr; }

  State Search(int iterations, const Mask* open, const EngineOptions& options) {
    return SearchPyramid(
        *view, pictures, sources, range, iterations, options,
        [&](size_t index, Level* level) { Expect(index, open, level); }, &finest);
  }

  State Resume(const PlaneMap& map, const EngineOptions& options) {
    finest = MakeLevel(*view, pictures[0], sources, 0, range, HashOf(options.seed, 0));
    Expect(0, Open(), &finest);
    return StateOf(finest, map, range);
  }

  /// Open pixels begin with their planes of the time step before, which the photos of this one
  /// check as every sweep does, next to those of what stands still; where they are lost, they are
  /// searched for as in a view that stands alone.
  State Follow(int iterations, const EngineOptions& options) {
    PlaneMap begin = time_step->before;
    KeepSettledPlanes(*time_step, &begin);
    State state = Resume(begin, options);
    SuggestBackground(&state);
    Sweep sweep;
    int number = kFollowPassNumber;
    RunSweeps(finest, sweep, kFollowIterations, 2 * kFinestStepPx, &number, &state);
    const Mask lost = LostPixels(finest, state, time_step->open);
    if (std::none_of(lost.data().begin(), lost.data().end(), [](auto m) { return m != 0; })) {
      return state;
    }
    const State found = Search(iterations, &lost, options);
    TakeCheaper(found, lost, &state);
    return state;
  }

  void SuggestBackground(State* state) const {
    if (!time_step || time_step->background.empty()) return;
    state->hypotheses.push_back(HypothesisOf(finest, time_step->background, range));
  }

  const StereoView* view;
  DepthRange range;
  std::vector<GreyImage> pictures;
  std::vector<SourcePyramid> sources;
  std::optional<PriorPlanes> prior;
  std::shared_ptr<const TimeStep> time_step;  ///< null: the view stands alone
  Level finest;
};

DepthEstimate Assessed(const Problem& problem, State* state, std::atomic<int>* without_planes) {
  bool planes_left_out = false;
  DepthEstimate estimate = FilteredDepth(problem.finest, *problem.view, problem.range,
                                         problem.time_step.get(), state, &planes_left_out);
  *without_planes += planes_left_out ? 1 : 0;
  return estimate;
}

}  // namespace

int PatchMatchEngine::Passes() const { return quality_.passes; }

int PatchMatchEngine::Neighbours() const {
  return std::min(kMaxViews, std::max(quality_.neighbours, quality_.pass_neighbours));
}

std::uint64_t PatchMatchEngine::WorkBytes(std::span<const StereoView> views, int reference,
                                          std::span<const int> neighbours) const {
  const auto area = [](double width, double height, double border) {
    return (width + 2 * border) * (height + 2 * border);
  };
  const PinholeCamera& camera = views[static_cast<size_t>(reference)].camera;
  const double w = camera.width_px(), h = camera.height_px();
  const size_t sources = std::min<size_t>(neighbours.size(), static_cast<size_t>(Neighbours()));
  const bool has_prior = views[static_cast<size_t>(reference)].prior != nullptr;
  const double state = kReferenceBytes + kStateBytes + kWeightBytes * static_cast<double>(sources) +
                       (has_prior ? kExpectedBytes : 0);
  const double search = area(w, h, kBorder) * state + std::max(area(w / 2, h / 2, kBorder) * state,
                                                               area(w, h, 0) * kEstimateBytes);
  const double pass = quality_.passes == 0 ? 0
                                           : area(w, h, kBorder) * (state + kGuessBytes) +
                                                 area(w, h, 0) * kPlaneBytes;
  double bytes = kSmallThingsBytes + std::max(search, pass) + area(w, h, 0) * kImageBytes;
  if (has_prior) bytes += static_cast<double>(PriorBytes(camera));
  if (views[static_cast<size_t>(reference)].time_step != nullptr) {
    bytes += static_cast<double>(TimeStepBytes(camera)) +
             area(w, h, kBorder) * (kOpenBytes + state) + area(w, h, 0) * kLostBytes;
  }
  for (size_t i = 0; i < sources; ++i) {
    const PinholeCamera& c = views[static_cast<size_t>(neighbours[i])].camera;
    bytes += kSourceBytes * area(c.width_px(), c.height_px(), kTextureBorder);
  }
  return static_cast<std::uint64_t>(bytes);
}

DepthEstimate PatchMatchEngine::Estimate(std::span<const StereoView> views, int reference,
                                         std::span<const int> neighbours, const DepthRange& range,
                                         const EngineOptions& options) const {
  Problem problem(views, reference, neighbours, range, {}, Neighbours());
  State state =
      problem.Search(options.look ? kLookIterations : quality_.iterations, problem.Open(), options);
  return Assessed(problem, &state, &without_planes_);
}

PlaneMap PatchMatchEngine::Match(std::span<const StereoView> views, int reference,
                                 std::span<const int> neighbours, const DepthRange& range,
                                 const EngineOptions& options) const {
  Problem problem(views, reference, neighbours, range, {}, quality_.neighbours);
  const bool follows = problem.time_step && !problem.time_step->before.empty();
  const State state = follows ? problem.Follow(quality_.iterations, options)
                              : problem.Search(quality_.iterations, problem.Open(), options);
  PlaneMap map = PlanesOf(problem.finest, state, range);
  if (problem.time_step) KeepSettledPlanes(*problem.time_step, &map);
  return map;
}

PlaneMap PatchMatchEngine::Refine(std::span<const StereoView> views, int reference,
                                  std::span<const int> neighbours, const DepthRange& range,
                                  std::span<const PlaneMap* const> maps, int pass,
                                  const EngineOptions& options) const {
  Problem problem(views, reference, neighbours, range, maps, quality_.pass_neighbours);
  State state = problem.Resume(*maps[static_cast<size_t>(reference)], options);
  HypothesesFromSurfaces(problem.finest, &state);
  problem.SuggestBackground(&state);
  ParallelFor(0, problem.finest.reference.height,
              [&](int y) { ExpectRow(problem.finest, y, &state); });
  Sweep sweep;
  sweep.move = sweep.jump = false;
  sweep.far_regions = 0;  // far planes have come as near as they could
  int number = kFirstPassNumber * pass;
  RunSweeps(problem.finest, sweep, kRefineIterations, kFinestStepPx, &number, &state);
  PlaneMap map = PlanesOf(problem.finest, state, range);
  if (problem.time_step) KeepSettledPlanes(*problem.time_step, &map);
  return map;
}

DepthEstimate PatchMatchEngine::Filter(std::span<const StereoView> views, int reference,
                                       std::span<const int> neighbours, const DepthRange& range,
                                       std::span<const PlaneMap* const> maps,
                                       const EngineOptions& options) const {
  Problem problem(views, reference, neighbours, range, maps, quality_.pass_neighbours);
  State state = problem.Resume(*maps[static_cast<size_t>(reference)], options);
  return Assessed(problem, &state, &without_planes_);
}

}  // namespace dtr::stereo
