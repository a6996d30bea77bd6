#include "calib/bundle/plain/minimise.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/bundle/plain/normal.h"
#include "calib/bundle/plain/place_points.h"
#include "calib/bundle/plain/reduced.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib::plain {
namespace {

// The gauge's directions are held by the damping alone, which must stay above the matrix' rounding.
constexpr double kMinLambda = 1e-12, kMaxLambda = 1e12;
constexpr double kMinRatio = 1e-3;   // of gained to promised, for a step to be taken
constexpr double kGoodRatio = 0.75;  // the model holds: less damping
// The model of a robust cost lies above it: steps are too short. Those of lenses may be far too
// long. Beyond these ratios another length is tried: the right one if the cost were a parabola
// along it.
constexpr double kFarRatio = 1.3, kNearRatio = 0.25, kMaxLength = 4;

// exp(step) exp(motion), and the centre moved.
void MovePose(const double* step, std::array<double, 6>& motion) {
  const auto turn = [](const double* w) {
    const Eigen::Vector3d v(w[0], w[1], w[2]);
    const double half = 0.5 * v.norm();
    const double sinc = half > 1e-8 ? std::sin(half) / half : 1.0;
    const Eigen::Vector3d imaginary = 0.5 * sinc * v;
    return Eigen::Quaterniond(std::cos(half), imaginary.x(), imaginary.y(), imaginary.z());
  };
  const Eigen::Quaterniond q = (turn(step) * turn(motion.data())).normalized();
  const Eigen::Vector3d imaginary =
      q.w() < 0 ? Eigen::Vector3d(-q.vec()) : Eigen::Vector3d(q.vec());
  const double sine = imaginary.norm();
  const double angle = 2 * std::atan2(sine, std::abs(q.w()));
  const Eigen::Vector3d w = (sine > 1e-12 ? angle / sine : 2.0) * imaginary;
  for (int k = 0; k < 3; ++k) {
    motion[static_cast<size_t>(k)] = w[k];
    motion[static_cast<size_t>(3 + k)] += step[3 + k];
  }
}

Unknowns Stepped(const Problem& problem, const Layout& layout, const Unknowns& x,
                 const Eigen::VectorXd& step, const std::vector<std::array<double, 3>>& points) {
  Unknowns next = x;
  for (size_t i = 0; i < problem.images() && layout.camera_size() > 0; ++i) {
    const double* const of = step.data() + layout.offset(i);
    if (problem.PoseMoves(i)) MovePose(of, next.motion[i]);
    if (layout.camera_size() < 8) continue;
    next.shift[i][0] += of[6];
    next.shift[i][1] += of[7];
  }
  for (size_t i = 0; i < next.theta.size(); ++i) {
    const std::vector<int>& free = problem.settings().free_params[i];
    const double* const of = step.data() + layout.offset(layout.LensNode(i));
    for (size_t k = 0; k < free.size(); ++k) next.theta[i][static_cast<size_t>(free[k])] += of[k];
  }
  for (size_t p = 0; p < points.size(); ++p) {
    for (size_t k = 0; k < 3; ++k) next.place[p][k] += points[p][k];
  }
  return next;
}

// The cost at `next`, a step from `x`. Of thousands of points one or another always steps behind a
// camera, where it has no pixel: one that is far away, or whose matches are wrong. It would have
// the step of all rejected, again and again; so it takes the largest part of its own step that
// keeps it in view.
double CostInView(const Problem& problem, const Unknowns& x, Unknowns& next) {
  const double cost = problem.CostAt(next);
  if (std::isfinite(cost)) return cost;
  const std::vector<Camera> cameras = problem.CamerasAt(next);
  const std::vector<Intrinsics> lenses = problem.IntrinsicsAt(next);
  const size_t chunks = (problem.points() + kChunkPoints - 1) / kChunkPoints;
  ParallelFor(0, static_cast<int>(chunks), [&](int chunk) {
    const size_t begin = static_cast<size_t>(chunk) * kChunkPoints;
    for (size_t p = begin; p < std::min(begin + kChunkPoints, problem.points()); ++p) {
      const std::array<double, 3> from = x.place[p], to = next.place[p];
      for (const double part : {1.0, 0.5, 0.25, 0.125, 0.0}) {
        for (size_t k = 0; k < 3; ++k) next.place[p][k] = from[k] + part * (to[k] - from[k]);
        if (std::isfinite(problem.PointCost(p, next.place[p], cameras, lenses))) break;
      }
    }
  });
  return problem.CostAt(next);
}

// lambda, and by what it grows when a step fails (Ceres' rule for its radius).
struct Damping {
  double lambda, growth = 2;
  void Accept(double ratio) {
    const double model = 2 * ratio - 1;
    const double factor =
        ratio > kGoodRatio ? 0.1 : std::clamp(1 - model * model * model, 0.1, 2.0);
    lambda = std::max(kMinLambda, lambda * factor);
    growth = 2;
  }
  void Reject() {
    lambda *= growth;
    growth *= 2;
  }
};

// Under a robust loss a point may waver between two of its observations: it would take dozens of
// steps of all unknowns, whose damping is one, to settle. By itself it takes a few (embedded point
// iterations: Jeong et al. 2012). Returns the cost.
double SettlePoints(const Problem& problem, MinimiseOptions options, Unknowns& x) {
  constexpr int kSteps = 4;
  options.max_iterations = kSteps;
  return PlacePoints(problem, options, x).cost;
}

}  // namespace

double RoundingOf(double cost, size_t coordinates, double largest_px) {
  constexpr double kRoundings = 8;  // operations between a point and its pixel that round
  const double rounding_px = kRoundings * std::numeric_limits<double>::epsilon() * largest_px;
  const auto count = static_cast<double>(coordinates);
  return std::sqrt(2 * cost * count) * rounding_px + 0.5 * count * rounding_px * rounding_px;
}

MinimiseResult Minimise(const Problem& problem, const MinimiseOptions& options, Unknowns& x) {
  const Layout layout(problem);
  if (layout.unknowns() == 0) return PlacePoints(problem, options, x);
  MinimiseResult result;
  result.cost = result.start_cost = problem.CostAt(x);
  if (!std::isfinite(result.cost)) return result;
  const bool robust = problem.loss().scale2 > 0;
  if (robust) result.cost = SettlePoints(problem, options, x);
  NormalEquations normal(problem, layout);
  ReducedSolver solver(problem, layout);
  Damping damping{options.start_lambda};
  double before = 0;  // promised by the step before; 0: none
  std::vector<std::array<double, 3>> points;
  while (result.iterations < options.max_iterations && damping.lambda < kMaxLambda) {
    if (options.progress != nullptr) options.progress->ThrowIfInterrupted();
    ++result.iterations;
    normal.Build(x, damping.lambda);
    const auto step = solver.Solve(normal);
    if (!step) {
      damping.Reject();
      continue;
    }
    double promised = 0.5 * step->dot(normal.damping().cwiseProduct(*step) - normal.gradient());
    normal.StepPoints(*step, points, &promised);
    const double hidden = RoundingOf(result.cost, 2 * problem.seen().size(), problem.largest_px());
    // What the step after this one will promise, if each promises as much less as this one does.
    const double next_promised = promised * (before > 0 ? std::min(1.0, promised / before) : 1);
    const bool last = next_promised <= options.cost_tolerance * result.cost || promised <= hidden;
    Unknowns next = Stepped(problem, layout, x, *step, points);
    double cost = CostInView(problem, x, next);
    const double ratio = promised > 0 ? (result.cost - cost) / promised : 0;
    if (((robust && ratio > kFarRatio) || ratio < kNearRatio) && std::isfinite(cost) && !last) {
      const double length = std::min(kMaxLength, 1 / std::max(2 - ratio, 1 / kMaxLength));
      for (auto& point : points) {
        for (double& p : point) p *= length;
      }
      Unknowns other = Stepped(problem, layout, x, length * *step, points);
      const double other_cost = CostInView(problem, x, other);
      if (other_cost < cost) cost = other_cost, next = std::move(other);
    }
    if (cost <= result.cost && (last || result.cost - cost > kMinRatio * promised)) {
      x = std::move(next);
      result.cost = robust ? SettlePoints(problem, options, x) : cost;
      damping.Accept(ratio);
      before = promised;
    } else {
      damping.Reject();
    }
    if (last) {
      result.converged = true;
      break;
    }
  }
  return result;
}

}  // namespace dtr::calib::plain
