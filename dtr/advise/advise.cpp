#include "dtr/advise/advise.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>

#include "dtr/advise/look.h"
#include "dtr/advise/places.h"
#include "dtr/advise/redundant.h"
#include "dtr/base/parallel_for.h"

namespace dtr::advise {
namespace {

constexpr size_t kPlacesTried = 48;    // the worst
constexpr size_t kPlacesTouched = 24;  // by a new camera: those about it
constexpr double kWorthIt = 0.02;      // badness that a camera must take away

// How far a place is from good: 0 and below is good.
double Badness(const Place& place, const AdviseOptions& options) {
  const double unseen = place.unseen_share - options.max_unseen;
  const double gap = place.gap_deg / options.max_gap_deg - 1;
  return std::max(unseen, 0.0) + 0.25 * std::clamp(gap, 0.0, 2.0);
}

// Places near `place`, itself among them.
std::vector<size_t> PlacesAbout(const std::vector<Place>& places, size_t place) {
  const Eigen::Vector3d here = places[place].cam_from_world.TargetOriginInSource();
  std::vector<std::pair<double, size_t>> near;
  for (size_t i = 0; i < places.size(); ++i) {
    near.emplace_back((places[i].cam_from_world.TargetOriginInSource() - here).norm(), i);
  }
  const size_t count = std::min(kPlacesTouched, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  std::vector<size_t> indices;
  for (size_t i = 0; i < count; ++i) indices.push_back(near[i].second);
  return indices;
}

int CountPoor(const std::vector<Place>& places) {
  return static_cast<int>(
      std::count_if(places.begin(), places.end(), [](const Place& place) { return place.poor; }));
}

// What a camera at places[index] takes off the badness of the places about it.
double GainOf(const std::vector<Place>& places, const std::vector<Look>& looks, size_t index,
              const AdviseOptions& options) {
  double gain = 0;
  for (const size_t about : PlacesAbout(places, index)) {
    const double before = Badness(places[about], options);
    if (before <= 0) continue;
    Look look = looks[about];
    Place after = places[about];
    AddPhoto(looks[index].view, look);
    Measure(look, options, after);
    gain += before - Badness(after, options);
  }
  return gain;
}

std::vector<size_t> WorstPlaces(const std::vector<Place>& places, const AdviseOptions& options) {
  std::vector<std::pair<double, size_t>> worst;
  for (size_t i = 0; i < places.size(); ++i) {
    const double badness = Badness(places[i], options);
    if (badness > 0) worst.emplace_back(-badness, i);
  }
  std::sort(worst.begin(), worst.end());
  if (worst.size() > kPlacesTried) worst.resize(kPlacesTried);
  std::vector<size_t> indices;
  for (const auto& [badness, index] : worst) indices.push_back(index);
  return indices;
}

// `places` and `looks` are worked on: they come to hold what the added cameras would show.
std::vector<Addition> ChooseAdditions(std::vector<Place> places, std::vector<Look>& looks,
                                      const AdviseOptions& options, Progress& progress) {
  progress.Stage("cameras to add", options.max_cameras_to_add);
  std::vector<Addition> additions;
  for (int n = 0; n < options.max_cameras_to_add; ++n) {
    progress.ThrowIfInterrupted();
    const std::vector<size_t> tried = WorstPlaces(places, options);
    std::vector<double> gains(tried.size());
    ParallelFor(0, static_cast<int>(tried.size()), [&](int i) {
      const auto at = static_cast<size_t>(i);
      gains[at] = GainOf(places, looks, tried[at], options);
    });
    const auto best = std::max_element(gains.begin(), gains.end());
    if (best == gains.end() || *best < kWorthIt) break;
    const size_t chosen = tried[static_cast<size_t>(best - gains.begin())];
    Addition addition{chosen, CountPoor(places), 0};
    const CoarseView photo = looks[chosen].view;
    for (const size_t about : PlacesAbout(places, chosen)) {
      AddPhoto(photo, looks[about]);
      Measure(looks[about], options, places[about]);
    }
    addition.poor_after = CountPoor(places);
    additions.push_back(addition);
    progress.Update(n + 1);
  }
  return additions;
}

std::vector<CoarseView> Without(std::span<const CoarseView> views,
                                const std::vector<Redundant>& redundant) {
  std::vector<CoarseView> staying(views.begin(), views.end());
  std::erase_if(staying, [&](const CoarseView& view) {
    return std::any_of(redundant.begin(), redundant.end(),
                       [&](const Redundant& one) { return one.name == view.name; });
  });
  return staying;
}

// Per view the name of the nearest one that stays: its own where it does.
std::vector<std::string> NearestNames(std::span<const CoarseView> views,
                                      const std::vector<CoarseView>& staying) {
  std::vector<std::string> names;
  for (const CoarseView& view : views) {
    const auto own = std::find_if(staying.begin(), staying.end(),
                                  [&](const CoarseView& other) { return other.name == view.name; });
    const auto nearest = std::min_element(
        staying.begin(), staying.end(), [&](const CoarseView& a, const CoarseView& b) {
          return (a.CenterInWorld() - view.CenterInWorld()).norm() <
                 (b.CenterInWorld() - view.CenterInWorld()).norm();
        });
    names.push_back((own != staying.end() ? own : nearest)->name);
  }
  return names;
}

}  // namespace

std::string WhyPoor(const Place& place, const AdviseOptions& options) {
  std::vector<std::string> reasons;
  if (place.unseen_share > options.max_unseen) {
    reasons.push_back(
        fmt::format("{:.0f} % of what it sees is in no photo", 100 * place.unseen_share));
  }
  if (place.gap_deg > options.max_gap_deg) {
    reasons.push_back(
        fmt::format("what it sees is up to {:.0f} degrees from the nearest photo", place.gap_deg));
  }
  return fmt::format("{}", fmt::join(reasons, ", "));
}

Advice Advise(std::span<const CoarseView> views, const AdviseOptions& options, Progress& progress) {
  if (views.size() < 2) throw std::invalid_argument("Advise: fewer than 2 views");
  Advice advice;
  advice.redundant = FindRedundant(views, options, progress);
  // Whoever is advised to leave cameras out must not be asked for another one between them.
  const std::vector<CoarseView> staying = Without(views, advice.redundant);
  advice.places = PlacesAmong(views, NearestNames(views, staying));
  const int count = static_cast<int>(advice.places.size());
  progress.Stage("looking from new positions", count);
  std::vector<Look> looks(advice.places.size());
  std::atomic<int> done{0};
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto at = static_cast<size_t>(i);
    looks[at] = LookFrom(advice.places[at], staying);
    Measure(looks[at], options, advice.places[at]);
    progress.Update(++done);
  });
  advice.add = ChooseAdditions(advice.places, looks, options, progress);
  return advice;
}

}  // namespace dtr::advise
