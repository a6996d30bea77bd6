// Which of the measured points matter: front, knee, what fits a budget.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "dtr/eval/sweep.h"

namespace dtr::eval {
namespace {

bool IsDefault(const SweepSetting& setting) {
  return std::all_of(setting.begin(), setting.end(), [](int value) { return value == 0; });
}

/// Index of the point that `better` puts before all others among those that `fits` lets through.
template <typename Fits, typename Better>
std::optional<size_t> Pick(std::span<const SweepPoint> points, const Fits& fits,
                           const Better& better) {
  std::optional<size_t> best;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!fits(points[i].measured)) continue;
    if (!best || better(points[i].measured, points[*best].measured)) best = i;
  }
  return best;
}

}  // namespace

CostRange RangeOf(const SweepPoint& point, std::span<const SweepPoint> sweep) {
  const SweepMeasurement& measured = point.measured;
  CostRange range{measured.cost_least, measured.cost_most};
  if (measured.machine_ms <= 0) return range;
  double min_ms = measured.machine_ms, max_ms = measured.machine_ms;
  for (const SweepPoint& other : sweep) {
    if (other.measured.machine_ms <= 0) continue;
    min_ms = std::min(min_ms, other.measured.machine_ms);
    max_ms = std::max(max_ms, other.measured.machine_ms);
  }
  // Repeats follow each other in one process. Frames of 1 to 70 CPU ms drawn by another one minutes
  // later on a busy machine took up to 9.6 % less (scripts/bench-replay).
  constexpr double kBetweenRuns = 0.1;
  range.least *= (1 - kBetweenRuns) * min_ms / measured.machine_ms;
  range.most *= (1 + kBetweenRuns) * max_ms / measured.machine_ms;
  return range;
}

std::vector<size_t> ParetoFront(std::span<const SweepPoint> points) {
  std::vector<size_t> order(points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    const SweepMeasurement &left = points[a].measured, &right = points[b].measured;
    return left.cost != right.cost ? left.cost < right.cost : left.error < right.error;
  });
  std::vector<size_t> front;
  for (const size_t i : order) {
    if (front.empty() || points[i].measured.error < points[front.back()].measured.error) {
      front.push_back(i);
    }
  }
  return front;
}

std::optional<size_t> KneeOf(std::span<const SweepPoint> points, std::span<const size_t> front) {
  if (front.size() < 3) return std::nullopt;
  const SweepMeasurement &cheap = points[front.front()].measured,
                         &good = points[front.back()].measured;
  const double costs = std::log(good.cost / cheap.cost),
               errors = std::log(cheap.error / good.error);
  constexpr double kOnTheLine = 1e-9;  // double; what rounding makes of points on the line
  double deepest = kOnTheLine;
  std::optional<size_t> knee;
  for (size_t i = 1; i + 1 < front.size(); ++i) {
    const SweepMeasurement& point = points[front[i]].measured;
    const double x = std::log(point.cost / cheap.cost) / costs;
    const double y = std::log(point.error / good.error) / errors;
    if (const double below = 1 - x - y; below > deepest) {
      deepest = below;
      knee = i;
    }
  }
  return knee;
}

std::optional<size_t> CheapestWithin(std::span<const SweepPoint> points, double max_loss_db) {
  std::optional<double> best_db;
  for (const SweepPoint& point : points) {
    if (point.measured.psnr_db) best_db = std::max(best_db.value_or(0), *point.measured.psnr_db);
  }
  if (!best_db) return std::nullopt;
  return Pick(
      points,
      [&](const SweepMeasurement& point) {
        return point.psnr_db && *point.psnr_db >= *best_db - max_loss_db;
      },
      [](const SweepMeasurement& a, const SweepMeasurement& b) { return a.cost < b.cost; });
}

std::optional<size_t> BestWithin(std::span<const SweepPoint> points, double budget) {
  return Pick(
      points, [&](const SweepMeasurement& point) { return point.cost <= budget; },
      [](const SweepMeasurement& a, const SweepMeasurement& b) {
        return a.error != b.error ? a.error < b.error : a.cost < b.cost;
      });
}

std::optional<DefaultAssessment> AssessDefault(std::span<const SweepPoint> points,
                                               std::span<const size_t> front) {
  DefaultAssessment assessment;
  while (assessment.at < points.size() && !IsDefault(points[assessment.at].setting))
    ++assessment.at;
  if (assessment.at == points.size()) return std::nullopt;
  assessment.on_front = std::find(front.begin(), front.end(), assessment.at) != front.end();
  if (assessment.on_front) return assessment;
  const SweepPoint& usual = points[assessment.at];
  assessment.beaten_by = Pick(
      points,
      [&](const SweepMeasurement& point) {
        return &point != &usual.measured && point.error <= usual.measured.error;
      },
      [](const SweepMeasurement& a, const SweepMeasurement& b) { return a.cost < b.cost; });
  if (assessment.beaten_by) {
    assessment.within_spread =
        RangeOf(points[*assessment.beaten_by], points).most >= RangeOf(usual, points).least;
  }
  return assessment;
}

}  // namespace dtr::eval
