#include "calib/bundle/lens_patterns.h"

#include <algorithm>
#include <numeric>

#include "calib/residual_patterns.h"

namespace dtr::calib {
namespace {

// The first column of each lens, -1 of those left out.
struct Places {
  std::vector<long> first;
  long columns = 0;
  int left_out = 0;
};

size_t LensOf(const Bundle& bundle, const BundleObservation& observation) {
  return static_cast<size_t>(bundle.images[static_cast<size_t>(observation.image)].lens);
}

// As many lenses as fit, those with most observations first.
Places PlacesOf(const Adjusted& adjusted, const BundleCovariance& layout, long per_lens) {
  const Bundle& bundle = adjusted.bundle;
  std::vector<int> observations(bundle.lenses.size());
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (adjusted.used[i]) ++observations[LensOf(bundle, bundle.observations[i])];
  }
  std::vector<size_t> order(bundle.lenses.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return observations[a] > observations[b]; });
  Places places{std::vector<long>(bundle.lenses.size(), -1), 0, 0};
  const long most = MostExtra(layout);
  for (const size_t lens : order) {
    if (places.columns + per_lens > most) {
      ++places.left_out;
      continue;
    }
    places.first[lens] = places.columns;
    places.columns += per_lens;
  }
  return places;
}

Eigen::Vector2d FromMiddle(const LensCamera& lens, const Eigen::Vector2d& pixel) {
  const PinholeCamera k = lens.Pinhole();
  return pixel - Eigen::Vector2d(k.cx_px(), k.cy_px());
}

// Per lens: how far from its principal point the farthest observation lies that counts, px.
std::vector<double> Reaches(const Adjusted& adjusted) {
  const Bundle& bundle = adjusted.bundle;
  std::vector<double> reach(bundle.lenses.size(), 1);
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (!adjusted.used[i]) continue;
    const size_t lens = LensOf(bundle, bundle.observations[i]);
    const double radius = FromMiddle(bundle.lenses[lens], bundle.observations[i].pixel).norm();
    reach[lens] = std::max(reach[lens], radius);
  }
  return reach;
}

}  // namespace

LensPatternTest TestRadialPattern(const Adjusted& adjusted, const BundleCovariance& layout) {
  const Bundle& bundle = adjusted.bundle;
  const Places places = PlacesOf(adjusted, layout, kRings);
  const std::vector<double> reach = Reaches(adjusted);
  const auto rings_of = [&](const BundleObservation& observation, const ObservationRows& rows) {
    std::vector<ExtraColumn> columns;
    const size_t lens = LensOf(bundle, observation);
    const Eigen::Vector2d way = FromMiddle(bundle.lenses[lens], DrawnAt(observation, rows));
    const double radius = way.norm();
    if (places.first[lens] < 0 || !(radius > 0)) return columns;
    const auto weights = RingWeights(radius / reach[lens]);
    for (size_t ring = 0; ring < kRings; ++ring) {
      if (weights[ring] > 0) {
        columns.push_back(
            {places.first[lens] + static_cast<long>(ring), weights[ring] * way / radius});
      }
    }
    return columns;
  };
  return {FitWider(adjusted, layout, places.columns, rings_of), places.left_out};
}

LensPatternTest TestRegionalPattern(const Adjusted& adjusted, const BundleCovariance& layout) {
  const Bundle& bundle = adjusted.bundle;
  const Places places = PlacesOf(adjusted, layout, 2L * kPatternRegions * kPatternRegions);
  const auto region_of = [&](const BundleObservation& observation, const ObservationRows& rows) {
    std::vector<ExtraColumn> columns;
    const size_t lens = LensOf(bundle, observation);
    if (places.first[lens] < 0) return columns;
    const int region = PatternRegionOf(DrawnAt(observation, rows), bundle.lenses[lens].width_px,
                                       bundle.lenses[lens].height_px);
    for (long axis = 0; axis < 2; ++axis) {
      columns.push_back({places.first[lens] + 2 * region + axis, Eigen::Vector2d::Unit(axis)});
    }
    return columns;
  };
  return {FitWider(adjusted, layout, places.columns, region_of), places.left_out};
}

}  // namespace dtr::calib
