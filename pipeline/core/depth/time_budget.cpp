#include "pipeline/core/depth/time_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "dtr/base/files.h"
#include "pipeline/core/depth/quality_json.h"
#include "stereo/widen.h"

namespace dtr::pipeline {
namespace {

constexpr std::uintmax_t kLargestRecord = 1 << 16;
constexpr int kProbeSidePx = 384;
constexpr stereo::QualitySettings kProbeQuality{};  // balanced
/// Sides at which the engine's pyramid ends, and what its first guess costs in visits.
constexpr int kCoarsestSidePx = 256;
constexpr double kFirstGuessVisits = 6;

constexpr stereo::QualitySettings kLadder[] = {
    {.neighbours = 2, .pass_neighbours = 4, .iterations = 1, .passes = 0},
    {.neighbours = 3, .pass_neighbours = 5, .iterations = 2, .passes = 1},
    {.neighbours = 4, .pass_neighbours = 6, .iterations = 2, .passes = 1},
    {.neighbours = 4, .pass_neighbours = 8, .iterations = 3, .passes = 2},
    {.neighbours = 5, .pass_neighbours = 8, .iterations = 3, .passes = 2},
    {.neighbours = 6, .pass_neighbours = 8, .iterations = 4, .passes = 2},
    {.neighbours = 8, .pass_neighbours = 8, .iterations = 5, .passes = 3},
};

int LevelsOf(const PinholeCamera& camera) {
  int levels = 1;
  while ((std::max(camera.width_px(), camera.height_px()) >> (levels - 1)) > kCoarsestSidePx) {
    ++levels;
  }
  return levels;
}

double PixelsOf(const PinholeCamera& camera) {
  return static_cast<double>(camera.width_px()) * static_cast<double>(camera.height_px());
}

/// Costs of the first view that can be matched at all; nothing when there is none.
std::optional<ProbedCosts> FirstProbe(const stereo::Collection& c) {
  for (size_t v = 0; v < c.neighbours.size(); ++v) {
    if (c.neighbours[v].views.empty()) continue;
    try {
      return ProbeCosts(c, static_cast<int>(v));
    } catch (const stereo::NoUsablePair&) {
      // Small copies have small disparities: another view may do.
    }
  }
  return {};
}

double SecondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

double VisitsPerPixel(int iterations, int levels) {
  double visits = 0;
  for (int level = 0; level < levels; ++level) {
    const bool coarsest = level + 1 == levels;
    const double here = coarsest     ? iterations + 2 + kFirstGuessVisits
                        : level == 0 ? std::max(1, iterations - 2)
                                     : iterations;
    visits += here * std::pow(0.25, level);
  }
  return visits;
}

ProbedCosts ProbeCosts(const stereo::Collection& c, int view) {
  const std::vector<int>& neighbours = c.neighbours[static_cast<size_t>(view)].views;
  std::vector<stereo::SmallView> small;
  std::vector<int> around{view};
  around.insert(around.end(), neighbours.begin(), neighbours.end());
  for (const int v : around) {
    stereo::Pages one_view;  // only its small copy is kept
    const stereo::ViewsAround alone(c.views, c.load_pixels, one_view, v, {});
    small.push_back(stereo::Shrink(alone.views()[static_cast<size_t>(v)], kProbeSidePx));
  }
  std::vector<stereo::StereoView> views;
  std::vector<int> others;
  for (size_t i = 0; i < small.size(); ++i) {
    const Pose& pose = c.views[static_cast<size_t>(around[i])].cam_from_world;
    views.push_back({small[i].camera, pose, &small[i].pixels.image, &small[i].pixels.mask});
    if (i > 0) others.push_back(static_cast<int>(i));
  }
  const auto engine = stereo::MakeEngine("patchmatch", kProbeQuality);
  const stereo::DepthRange& range = c.ranges[static_cast<size_t>(view)];
  std::vector<stereo::PlaneMap> maps(views.size());
  ProbedCosts costs;
  costs.search_s = SecondsOf([&] { maps[0] = engine->Match(views, 0, others, range, c.options); });
  // Neighbours' planes cost the same whatever they are: those of the view itself serve.
  std::vector<const stereo::PlaneMap*> pointers;
  for (size_t i = 0; i < maps.size(); ++i) {
    const bool fits = small[i].camera.width_px() == small[0].camera.width_px() &&
                      small[i].camera.height_px() == small[0].camera.height_px();
    pointers.push_back(fits ? &maps[0] : nullptr);
  }
  costs.pass_s =
      SecondsOf([&] { engine->Refine(views, 0, others, range, pointers, 1, c.options); });
  costs.check_s = SecondsOf([&] { engine->Filter(views, 0, others, range, pointers, c.options); });
  const double pixels = PixelsOf(small[0].camera);
  const double available = static_cast<double>(others.size());
  const double searched = std::min<double>(kProbeQuality.neighbours, available);
  const double asked = std::min<double>(kProbeQuality.pass_neighbours, available);
  costs.search_s /=
      pixels * searched * VisitsPerPixel(kProbeQuality.iterations, LevelsOf(small[0].camera));
  costs.pass_s /= pixels * asked;
  costs.check_s /= pixels * asked;
  return costs;
}

double PredictSeconds(const ProbedCosts& costs, const stereo::QualitySettings& quality,
                      std::span<const stereo::StereoView> views) {
  const double others = static_cast<double>(views.size()) - 1;
  const double searched = std::min<double>(quality.neighbours, others);
  const double asked = std::min<double>(quality.pass_neighbours, others);
  double seconds = 0;
  for (const stereo::StereoView& view : views) {
    const double visits = VisitsPerPixel(quality.iterations, LevelsOf(view.camera));
    // Every range is looked at once before the search (stereo/widen.h); how many of them move, and
    // are looked at again, is not known yet.
    const double side = std::max(view.camera.width_px(), view.camera.height_px());
    const double shrink = stereo::LookSide(view.camera) / side;
    seconds += PixelsOf(view.camera) * shrink * shrink * costs.search_s *
               std::min<double>(stereo::kLookNeighbours, std::max(searched, asked)) *
               VisitsPerPixel(quality.iterations, 1);
    seconds += PixelsOf(view.camera) * (costs.search_s * searched * visits +
                                        (costs.pass_s * quality.passes + costs.check_s) * asked);
  }
  return seconds;
}

std::span<const stereo::QualitySettings> QualityLadder() { return kLadder; }

stereo::QualitySettings PickQuality(const ProbedCosts& costs, const DepthChoice& choice,
                                    std::span<const stereo::StereoView> views) {
  stereo::QualitySettings picked = Overridden(kLadder[0], choice);
  for (const stereo::QualitySettings& rung : kLadder) {
    const stereo::QualitySettings quality = Overridden(rung, choice);
    if (PredictSeconds(costs, quality, views) <= *choice.time_budget_s) picked = quality;
  }
  return picked;
}

stereo::QualitySettings QualityWithinBudget(const stereo::Collection& c, const DepthChoice& choice,
                                            const std::filesystem::path& record,
                                            Progress& progress) {
  if (std::filesystem::exists(record)) {
    return QualityFromJson(ReadFile(record, kLargestRecord), record.string());
  }
  stereo::QualitySettings quality = Overridden(kLadder[0], choice);
  if (const auto costs = FirstProbe(c)) {
    quality = PickQuality(*costs, choice, c.views);
    const double expected_s = PredictSeconds(*costs, quality, c.views);
    progress.Note(fmt::format(
        "time budget {} s: {} neighbours, {} in {} passes, {} iterations; expected {:.1f} s{}",
        *choice.time_budget_s, quality.neighbours, quality.pass_neighbours, quality.passes,
        quality.iterations, expected_s,
        expected_s > *choice.time_budget_s ? ", MORE than the budget: nothing cheaper is left"
                                           : ""));
  } else {
    progress.Note("time budget: no view has a usable pair to try; the lowest settings are used");
  }
  WriteFileAtomically(record, SettingsJson("patchmatch", quality).dump());
  return quality;
}

}  // namespace dtr::pipeline
