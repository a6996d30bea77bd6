#include "calib/sfm/mapping/positioning.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/solve/conjugate_gradients.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kTracksPerImage = 150;
constexpr int kStarts = 3;
constexpr int kMaxIterations = 150;
constexpr double kHuber = 0.1;       // of a unit ray: 6 degrees, as in GLOMAP
constexpr double kMinFactor = 1e-5;  // keeps points before cameras
constexpr double kSettled = 1e-5;    // of the cost

struct Seen {
  int camera = 0;
  Vector3d ray;  // in the world
};

struct Problem {
  int cameras = 0;
  std::vector<int> node_of;   // per camera
  std::vector<size_t> first;  // per point, and one more
  std::vector<Seen> seen;
};

struct State {
  std::vector<Vector3d> centres, points;
  std::vector<double> factors;
};

Problem MakeProblem(std::span<const Matrix3d> cam_from_world, const Rays& rays,
                    std::span<const int> node_of, std::span<const Track> tracks,
                    const std::vector<int>& chosen) {
  Problem problem;
  std::vector<int> camera_of(cam_from_world.size(), -1);
  problem.first.push_back(0);
  for (const int t : chosen) {
    for (const TrackFeature& f : tracks[t]) {
      const Vector3d& ray = rays[f.image][f.feature];
      if (ray.isZero()) continue;
      const int node = node_of[static_cast<size_t>(f.image)];
      if (camera_of[node] < 0) {
        camera_of[node] = problem.cameras++;
        problem.node_of.push_back(node);
      }
      problem.seen.push_back({camera_of[node], cam_from_world[f.image].transpose() * ray});
    }
    problem.first.push_back(problem.seen.size());
  }
  return problem;
}

// Centres at random in a cube; points where their rays would put them at unit distance.
State RandomStart(const Problem& problem, std::uint64_t seed) {
  State state;
  for (int c = 0; c < problem.cameras; ++c) {
    Random random(HashOf(seed, static_cast<std::uint64_t>(problem.node_of[c])));
    const double x = random.Uniform(-1, 1), y = random.Uniform(-1, 1);
    state.centres.emplace_back(x, y, random.Uniform(-1, 1));
  }
  for (size_t p = 0; p + 1 < problem.first.size(); ++p) {
    Vector3d sum = Vector3d::Zero();
    for (size_t i = problem.first[p]; i < problem.first[p + 1]; ++i) {
      sum += state.centres[problem.seen[i].camera] + problem.seen[i].ray;
    }
    const size_t count = problem.first[p + 1] - problem.first[p];
    state.points.push_back(sum / static_cast<double>(std::max<size_t>(count, 1)));
  }
  state.factors.assign(problem.seen.size(), 1);
  return state;
}

double LossOf(double squared) {
  return squared <= kHuber * kHuber ? squared : 2 * kHuber * std::sqrt(squared) - kHuber * kHuber;
}
double WeightOf(double squared) {
  return squared <= kHuber * kHuber ? 1 : kHuber / std::sqrt(squared);
}

double CostOf(const Problem& problem, const State& state) {
  double cost = 0;
  for (size_t p = 0; p + 1 < problem.first.size(); ++p) {
    for (size_t i = problem.first[p]; i < problem.first[p + 1]; ++i) {
      const Seen& seen = problem.seen[i];
      const Vector3d u = state.points[p] - state.centres[seen.camera];
      cost += LossOf((seen.ray - state.factors[i] * u).squaredNorm());
    }
  }
  return cost;
}

// The centres' equations without factors and points, which are never written out: their product
// with a vector needs one pass over the observations.
class Solver {
 public:
  explicit Solver(const Problem& problem) : problem_(problem), inner_(problem.cameras) {}

  // Solves the equations at `state`; false where they cannot be.
  bool Step(const State& state, double lambda, State* next) {
    Build(state, lambda);
    const auto step = calib::ConjugateGradients(
        right_, kLinear, [&](const Eigen::VectorXd& x) { return Product(x); },
        [&](const Eigen::VectorXd& x) { return Times(inner_, x); });
    if (!step || !step->allFinite()) return false;
    Apply(state, *step, next);
    return true;
  }

 private:
  static constexpr calib::ConjugateGradientsOptions kLinear{.gain = 0.01, .max_iterations = 1000};

  // An observation with its factor eliminated. With u = X - c, residual r = v - d u has the
  // derivatives -u by d, -d by X and d by c. Elimination of d leaves the matrix h = w d^2 P with
  // P = 1 - u u^T / ((1 + lambda) u^2), and the gradient by X  g = -w d P r; by c the opposite.
  struct Part {
    Vector3d u, g;
    double weight = 0, inverse_u2 = 0;  // w d^2; damped
    Vector3d Times(const Vector3d& x) const { return weight * (x - inverse_u2 * u.dot(x) * u); }
    Matrix3d H() const {
      return weight * (Matrix3d::Identity() - inverse_u2 * (u * u.transpose()));
    }
  };
  Part PartOf(const State& state, size_t point, size_t i, double lambda) const {
    const Vector3d u = state.points[point] - state.centres[problem_.seen[i].camera];
    const double d = state.factors[i];
    const Vector3d r = problem_.seen[i].ray - d * u;
    const double w = WeightOf(r.squaredNorm());
    const double inverse_u2 = 1 / ((1 + lambda) * u.squaredNorm() + 1e-12);
    return {u, -w * d * (r - inverse_u2 * u.dot(r) * u), w * d * d, inverse_u2};
  }

  void Build(const State& state, double lambda) {
    blocks_.assign(problem_.cameras, Matrix3d::Zero());
    std::fill(inner_.begin(), inner_.end(), Matrix3d::Zero());
    right_ = Eigen::VectorXd::Zero(3 * problem_.cameras);
    inverse_.resize(state.points.size());
    gradient_.resize(state.points.size());
    parts_.resize(problem_.seen.size());
    for (size_t p = 0; p < state.points.size(); ++p) {
      Matrix3d h = Matrix3d::Zero();
      Vector3d g = Vector3d::Zero();
      const size_t first = problem_.first[p], end = problem_.first[p + 1];
      for (size_t i = first; i < end; ++i) {
        parts_[i] = PartOf(state, p, i, lambda);
        h += parts_[i].H();
        g += parts_[i].g;
      }
      h.diagonal() *= 1 + lambda;
      h.diagonal().array() += 1e-12;
      inverse_[p] = h.inverse();
      gradient_[p] = g;
      const Vector3d shift = inverse_[p] * g;
      for (size_t i = first; i < end; ++i) {
        const int c = problem_.seen[i].camera;
        const Matrix3d hi = parts_[i].H();
        blocks_[c] += hi;
        inner_[c] -= hi * inverse_[p] * hi;
        // The cross block of point and camera is -h_i.
        right_.segment<3>(3 * c) += parts_[i].g - parts_[i].Times(shift);
      }
    }
    for (int c = 0; c < problem_.cameras; ++c) {
      blocks_[c].diagonal() *= 1 + lambda;
      blocks_[c].diagonal().array() += 1e-10;  // the gauge: world's origin and unit
      inner_[c] = (blocks_[c] + inner_[c]).inverse().eval();
    }
  }

  static Eigen::VectorXd Times(const std::vector<Matrix3d>& blocks, const Eigen::VectorXd& x) {
    Eigen::VectorXd y(x.size());
    for (size_t c = 0; c < blocks.size(); ++c) {
      const auto at = static_cast<Eigen::Index>(3 * c);
      y.segment<3>(at) = blocks[c] * x.segment<3>(at);
    }
    return y;
  }

  Eigen::VectorXd Product(const Eigen::VectorXd& x) const {
    Eigen::VectorXd y = Times(blocks_, x);
    for (size_t p = 0; p < inverse_.size(); ++p) {
      const Vector3d moved = inverse_[p] * PullOf(p, x);
      for (size_t i = problem_.first[p]; i < problem_.first[p + 1]; ++i) {
        y.segment<3>(3 * problem_.seen[i].camera) -= parts_[i].Times(moved);
      }
    }
    return y;
  }

  // What a step of the cameras adds to the right side of a point's equations.
  Vector3d PullOf(size_t point, const Eigen::VectorXd& step) const {
    Vector3d sum = Vector3d::Zero();
    for (size_t i = problem_.first[point]; i < problem_.first[point + 1]; ++i) {
      sum += parts_[i].Times(step.segment<3>(3 * problem_.seen[i].camera));
    }
    return sum;
  }

  void Apply(const State& state, const Eigen::VectorXd& step, State* next) const {
    *next = state;
    for (int c = 0; c < problem_.cameras; ++c) next->centres[c] += step.segment<3>(3 * c);
    for (size_t p = 0; p < state.points.size(); ++p) {
      const Vector3d dx = inverse_[p] * (PullOf(p, step) - gradient_[p]);
      next->points[p] += dx;
      for (size_t i = problem_.first[p]; i < problem_.first[p + 1]; ++i) {
        const Vector3d& u = parts_[i].u;
        const Vector3d du = dx - step.segment<3>(3 * problem_.seen[i].camera);
        const Vector3d r = problem_.seen[i].ray - state.factors[i] * (u + du);
        next->factors[i] = std::max(kMinFactor, state.factors[i] + u.dot(r) * parts_[i].inverse_u2);
      }
    }
  }

  const Problem& problem_;
  std::vector<Matrix3d> blocks_;   // of the cameras, before the points' elimination
  std::vector<Matrix3d> inner_;    // inverse of a camera's own block after it: the preconditioner
  std::vector<Matrix3d> inverse_;  // of the points' blocks
  std::vector<Vector3d> gradient_;
  std::vector<Part> parts_;
  Eigen::VectorXd right_;
};

double Minimise(const Problem& problem, State* state, const Progress* progress) {
  Solver solver(problem);
  double cost = CostOf(problem, *state), lambda = 1e-2;
  State next;
  int small = 0;
  for (int i = 0; i < kMaxIterations && lambda < 1e8; ++i) {
    if (progress != nullptr) progress->ThrowIfInterrupted();
    const bool solved = solver.Step(*state, lambda, &next);
    const double next_cost = solved ? CostOf(problem, next) : cost;
    if (!solved || !(next_cost < cost)) {
      lambda *= 4;
      continue;
    }
    small = cost - next_cost < kSettled * cost ? small + 1 : 0;
    std::swap(*state, next);
    cost = next_cost;
    lambda = std::max(lambda / 3, 1e-8);
    if (small >= 3) break;
  }
  return cost / static_cast<double>(std::max<size_t>(problem.seen.size(), 1));
}

}  // namespace

std::vector<int> CoveringTracks(int images, std::span<const Track> tracks, int per_image) {
  std::vector<int> order(tracks.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int x, int y) { return tracks[x].size() > tracks[y].size(); });
  std::vector<int> count(images), chosen;
  for (const int t : order) {
    const bool needed = std::any_of(tracks[t].begin(), tracks[t].end(), [&](const TrackFeature& f) {
      return count[f.image] < per_image;
    });
    if (!needed) continue;
    for (const TrackFeature& f : tracks[t]) ++count[f.image];
    chosen.push_back(t);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

Positions PlaceCameras(std::span<const Matrix3d> cam_from_world, const Rays& rays,
                       std::span<const int> node_of, std::span<const Track> tracks,
                       std::uint64_t seed, const Progress* progress) {
  const auto images = static_cast<int>(cam_from_world.size());
  const Problem problem = MakeProblem(cam_from_world, rays, node_of, tracks,
                                      CoveringTracks(images, tracks, kTracksPerImage));
  std::vector<State> states(kStarts);
  std::vector<double> costs(kStarts);
  ParallelFor(0, kStarts, [&](int s) {
    states[s] = RandomStart(problem, HashOf(seed, static_cast<std::uint64_t>(s)));
    costs[s] = Minimise(problem, &states[s], progress);
  });
  const auto best = std::min_element(costs.begin(), costs.end()) - costs.begin();
  Positions positions{std::vector<Vector3d>(images, Vector3d::Zero()), costs[best]};
  std::vector<int> camera_of(images, -1);
  for (int c = 0; c < problem.cameras; ++c) camera_of[problem.node_of[c]] = c;
  for (int i = 0; i < images; ++i) {
    const int camera = camera_of[node_of[static_cast<size_t>(i)]];
    if (camera >= 0) positions.centres[i] = states[best].centres[camera];
  }
  return positions;
}

}  // namespace dtr::sfm
