#include "calib/bundle/plain/place_points.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"

namespace dtr::calib::plain {
namespace {

constexpr double kSmallestLambda = 1e-12, kLargestLambda = 1e12;
constexpr double kMinShareOfDistance = 1e-6;  // as in normal.cpp
constexpr double kHarmlessDrift = 1e-7;       // of the cost, that more steps would gain

struct PointEquations {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

PointEquations EquationsOf(const Problem& problem, size_t point, const std::array<double, 3>& place,
                           const std::vector<Camera>& cameras,
                           const std::vector<Intrinsics>& lenses) {
  PointEquations equations;
  const PointFrame& frame = problem.n().points[point];
  const PointAt at(frame, place);
  for (size_t i = problem.first(point); i < problem.first(point + 1); ++i) {
    const Seen& seen = problem.seen()[i];
    const Camera& camera = cameras[static_cast<size_t>(seen.image)];
    const Eigen::Vector3d offset = frame.anchor - camera.centre;
    const Eigen::Vector3d p = camera.rotation * (at.direction + at.rho * offset);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_p;
    double by_lens[2 * kColumns];
    Differentiate(lenses[camera.lens], p.data(), pixel.data(), by_p.data(), by_lens);
    const Eigen::Vector2d r = pixel + camera.shift_px - seen.pixel;
    const Eigen::Matrix<double, 2, 3> by_world = by_p * camera.rotation;
    Eigen::Matrix<double, 2, 3> by_place;
    by_place << by_world * frame.e1, by_world * frame.e2, by_world * offset;
    // J^T W J with W = slope (I + (bend - 1) r r^T / |r|^2), and J^T slope r.
    const double squared = r.squaredNorm(), slope = problem.loss().Slope(squared);
    const Eigen::Vector3d towards = by_place.transpose() * r;
    equations.gradient += slope * towards;
    equations.matrix += slope * by_place.transpose() * by_place;
    if (problem.loss().scale2 > 0 && squared > 0) {
      const double bend = slope * (problem.loss().Bend(squared) - 1) / squared;
      equations.matrix += bend * towards * towards.transpose();
    }
  }
  return equations;
}

struct PointResult {
  double start_cost = 0, cost = 0;
  double promised = 0;  ///< what another step would gain, where it did not converge
  int iterations = 0;
};

PointResult PlaceOne(const Problem& problem, size_t point, const MinimiseOptions& options,
                     const std::vector<Camera>& cameras, const std::vector<Intrinsics>& lenses,
                     double enough, std::array<double, 3>& place) {
  PointResult result;
  result.cost = result.start_cost = problem.PointCost(point, place, cameras, lenses);
  const size_t count = problem.first(point + 1) - problem.first(point);
  if (count == 0 || !std::isfinite(result.cost)) {
    return result;
  }
  double lambda = options.start_lambda, growth = 2;
  PointEquations equations;
  bool fresh = false;
  while (result.iterations < options.max_iterations && lambda < kLargestLambda) {
    ++result.iterations;
    if (!fresh) equations = EquationsOf(problem, point, place, cameras, lenses);
    fresh = true;
    Eigen::Vector3d diagonal = equations.matrix.diagonal();
    diagonal[2] = std::max(diagonal[2], kMinShareOfDistance * (diagonal[0] + diagonal[1]));
    Eigen::Matrix3d damped = equations.matrix;
    damped.diagonal() += lambda * diagonal;
    const Eigen::Vector3d step = -damped.ldlt().solve(equations.gradient);
    const double promised =
        0.5 * step.dot(lambda * diagonal.cwiseProduct(step) - equations.gradient);
    const double hidden = RoundingOf(result.cost, 2 * count, problem.largest_px());
    const bool last = step.allFinite() && promised <= std::max(enough, hidden);
    result.promised = last ? 0 : promised;
    const std::array<double, 3> next{place[0] + step[0], place[1] + step[1], place[2] + step[2]};
    const double cost = problem.PointCost(point, next, cameras, lenses);
    if (cost <= result.cost && (last || result.cost - cost > 1e-3 * promised)) {
      place = next;
      result.cost = cost;
      lambda = std::max(kSmallestLambda, 0.1 * lambda);
      growth = 2;
      fresh = false;
    } else {
      lambda *= growth;
      growth *= 2;
    }
    if (last) break;
  }
  return result;
}

}  // namespace

MinimiseResult PlacePoints(const Problem& problem, const MinimiseOptions& options, Unknowns& x) {
  const std::vector<Camera> cameras = problem.CamerasAt(x);
  const std::vector<Intrinsics> lenses = problem.IntrinsicsAt(x);
  MinimiseResult result;
  result.cost = result.start_cost = problem.CostAt(x);
  if (!std::isfinite(result.cost)) return result;
  // Of the mean point's cost: points that two images see have next to none of their own.
  const double enough = options.cost_tolerance * result.cost /
                        static_cast<double>(std::max<size_t>(1, problem.points()));
  const size_t chunks = (problem.points() + kChunkPoints - 1) / kChunkPoints;
  std::vector<PointResult> parts(chunks);
  ParallelFor(0, static_cast<int>(chunks), [&](int chunk) {
    if (options.progress != nullptr) options.progress->ThrowIfInterrupted();
    const size_t begin = static_cast<size_t>(chunk) * kChunkPoints;
    PointResult& part = parts[static_cast<size_t>(chunk)];
    for (size_t p = begin; p < std::min(begin + kChunkPoints, problem.points()); ++p) {
      const PointResult one = PlaceOne(problem, p, options, cameras, lenses, enough, x.place[p]);
      part.cost += one.cost - one.start_cost;
      part.promised += one.promised;
      part.iterations = std::max(part.iterations, one.iterations);
    }
  });
  double promised = 0;
  for (const PointResult& part : parts) {
    result.cost += part.cost;
    promised += part.promised;
    result.iterations = std::max(result.iterations, part.iterations);
  }
  // Some points may drift for ever, to infinity or along their ray; together they gain nothing.
  result.converged = promised <= kHarmlessDrift * result.cost;
  return result;
}

}  // namespace dtr::calib::plain
