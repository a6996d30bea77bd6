#include "calib/sfm/mapping/positioning.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

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

// Blocks of cameras that share a point: where they are, and which of them a point adds to. Made
// once for all starts and all steps.
class Pattern {
 public:
  explicit Pattern(const Problem& problem) : cameras_(problem.cameras) {
    for (size_t p = 0; p + 1 < problem.first.size(); ++p) {
      ForEachPair(problem, p, [&](int row, int column) { keys_.push_back(Key(row, column)); });
      if (keys_.size() > kKeysAtOnce) SortUnique();
    }
    for (int c = 0; c < cameras_; ++c) keys_.push_back(Key(c, c));
    SortUnique();
    for (size_t p = 0; p + 1 < problem.first.size(); ++p) {
      ForEachPair(problem, p, [&](int row, int column) { slots_.push_back(SlotOf(row, column)); });
    }
    for (int c = 0; c < cameras_; ++c) diagonal_.push_back(SlotOf(c, c));
    MakeMatrix();
  }

  /// Calls body(row, column) for the cameras of each two observations of a point, lower triangle.
  template <typename Body>
  static void ForEachPair(const Problem& problem, size_t point, const Body& body) {
    for (size_t i = problem.first[point]; i < problem.first[point + 1]; ++i) {
      for (size_t k = problem.first[point]; k < problem.first[point + 1]; ++k) {
        const int row = problem.seen[i].camera, column = problem.seen[k].camera;
        if (row >= column) body(row, column);
      }
    }
  }

  size_t blocks() const { return keys_.size(); }
  /// Of the pairs of all points, in the order of ForEachPair.
  const std::vector<std::uint32_t>& slots() const { return slots_; }
  std::uint32_t diagonal(int camera) const { return diagonal_[camera]; }

  /// The lower triangle of the matrix with these blocks.
  void Fill(const std::vector<Matrix3d>& blocks, Eigen::SparseMatrix<double>* matrix) const {
    *matrix = zeros_;
    double* value = matrix->valuePtr();
    ForEachEntry([&](size_t block, int i, int k) { *value++ = blocks[block](i, k); });
  }

 private:
  static constexpr size_t kKeysAtOnce = 4000000;

  static std::uint64_t Key(int row, int column) {
    return static_cast<std::uint64_t>(column) << 32 | static_cast<std::uint32_t>(row);
  }
  static int Row(std::uint64_t key) { return static_cast<int>(key & 0xffffffffu); }
  static int Column(std::uint64_t key) { return static_cast<int>(key >> 32); }
  void SortUnique() {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
  }
  std::uint32_t SlotOf(int row, int column) const {
    const auto at = std::lower_bound(keys_.begin(), keys_.end(), Key(row, column));
    return static_cast<std::uint32_t>(at - keys_.begin());
  }

  // Calls body(block, row in it, column in it) for all entries of the lower triangle, column by
  // column, as a compressed matrix stores them.
  template <typename Body>
  void ForEachEntry(const Body& body) const {
    for (size_t begin = 0, end = 0; begin < keys_.size(); begin = end) {
      while (end < keys_.size() && Column(keys_[end]) == Column(keys_[begin])) ++end;
      for (int k = 0; k < 3; ++k) {
        for (size_t block = begin; block < end; ++block) {
          const bool on_diagonal = Row(keys_[block]) == Column(keys_[block]);
          for (int i = on_diagonal ? k : 0; i < 3; ++i) body(block, i, k);
        }
      }
    }
  }

  void MakeMatrix() {
    std::vector<Eigen::Triplet<double>> entries;
    ForEachEntry([&](size_t block, int i, int k) {
      entries.emplace_back(3 * Row(keys_[block]) + i, 3 * Column(keys_[block]) + k, 0.0);
    });
    zeros_.resize(3 * cameras_, 3 * cameras_);
    zeros_.setFromTriplets(entries.begin(), entries.end());
  }

  int cameras_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> slots_, diagonal_;
  Eigen::SparseMatrix<double> zeros_;
};

class Solver {
 public:
  Solver(const Problem& problem, const Pattern& pattern)
      : problem_(problem), pattern_(pattern), blocks_(pattern.blocks()) {}

  // Reduced equations at `state`, solved; false where they cannot be.
  bool Step(const State& state, double lambda, State* next) {
    Build(state, lambda);
    pattern_.Fill(blocks_, &matrix_);
    if (!analysed_) solver_.analyzePattern(matrix_);
    analysed_ = true;
    solver_.factorize(matrix_);
    if (solver_.info() != Eigen::Success) return false;
    const Eigen::VectorXd step = solver_.solve(right_);
    if (!step.allFinite()) return false;
    Apply(state, step, next);
    return true;
  }

 private:
  // An observation with its factor eliminated. With u = X - c, residual r = v - d u has the
  // derivatives -u by d, -d by X and d by c. Elimination of d leaves the matrix w d^2 P with
  // P = 1 - u u^T / ((1 + lambda) u^2), and the gradient by X  -w d P r.
  struct Part {
    Matrix3d h;
    Vector3d g;     // by X; by c the opposite
    double u2 = 0;  // damped
  };
  Part PartOf(const State& state, size_t point, size_t i, double lambda) const {
    const Vector3d u = state.points[point] - state.centres[problem_.seen[i].camera];
    const double d = state.factors[i];
    const Vector3d r = problem_.seen[i].ray - d * u;
    const double w = WeightOf(r.squaredNorm());
    const double u2 = (1 + lambda) * u.squaredNorm() + 1e-12;
    const Matrix3d p = Matrix3d::Identity() - u * u.transpose() / u2;
    return {w * d * d * p, -w * d * (p * r), u2};
  }

  void Build(const State& state, double lambda) {
    for (Matrix3d& block : blocks_) block.setZero();
    right_ = Eigen::VectorXd::Zero(3 * problem_.cameras);
    inverse_.resize(state.points.size());
    gradient_.resize(state.points.size());
    parts_.resize(problem_.seen.size());
    Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(3 * problem_.cameras);
    const std::uint32_t* slot = pattern_.slots().data();
    for (size_t p = 0; p < state.points.size(); ++p) {
      Matrix3d h = Matrix3d::Zero();
      Vector3d g = Vector3d::Zero();
      const size_t first = problem_.first[p], end = problem_.first[p + 1];
      for (size_t i = first; i < end; ++i) {
        parts_[i] = PartOf(state, p, i, lambda);
        h += parts_[i].h;
        g += parts_[i].g;
        const int c = problem_.seen[i].camera;
        blocks_[pattern_.diagonal(c)] += parts_[i].h;
        diagonal.segment<3>(3 * c) += parts_[i].h.diagonal();
        right_.segment<3>(3 * c) += parts_[i].g;  // minus the gradient by c
      }
      h.diagonal() *= 1 + lambda;
      h.diagonal().array() += 1e-12;
      inverse_[p] = h.inverse();
      gradient_[p] = g;
      // The cross block of point and camera is -h_i.
      for (size_t i = first; i < end; ++i) {
        const Matrix3d hi = parts_[i].h * inverse_[p];
        const int ci = problem_.seen[i].camera;
        right_.segment<3>(3 * ci) -= hi * g;
        for (size_t k = first; k < end; ++k) {
          const int ck = problem_.seen[k].camera;
          if (ci >= ck) blocks_[*slot++].noalias() -= hi * parts_[k].h;
        }
      }
    }
    for (int c = 0; c < problem_.cameras; ++c) {
      Matrix3d& block = blocks_[pattern_.diagonal(c)];
      block.diagonal() += lambda * diagonal.segment<3>(3 * c);
      block.diagonal().array() += 1e-10;  // the gauge: world's origin and unit
    }
  }

  void Apply(const State& state, const Eigen::VectorXd& step, State* next) const {
    *next = state;
    for (int c = 0; c < problem_.cameras; ++c) next->centres[c] += step.segment<3>(3 * c);
    for (size_t p = 0; p < state.points.size(); ++p) {
      Vector3d right = -gradient_[p];
      for (size_t i = problem_.first[p]; i < problem_.first[p + 1]; ++i) {
        right += parts_[i].h * step.segment<3>(3 * problem_.seen[i].camera);
      }
      const Vector3d dx = inverse_[p] * right;
      next->points[p] += dx;
      for (size_t i = problem_.first[p]; i < problem_.first[p + 1]; ++i) {
        const Vector3d u = state.points[p] - state.centres[problem_.seen[i].camera];
        const Vector3d du = dx - step.segment<3>(3 * problem_.seen[i].camera);
        const Vector3d r = problem_.seen[i].ray - state.factors[i] * (u + du);
        next->factors[i] = std::max(kMinFactor, state.factors[i] + u.dot(r) / parts_[i].u2);
      }
    }
  }

  const Problem& problem_;
  const Pattern& pattern_;
  std::vector<Matrix3d> blocks_, inverse_;
  std::vector<Vector3d> gradient_;
  std::vector<Part> parts_;
  Eigen::VectorXd right_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  bool analysed_ = false;
};

double Minimise(const Problem& problem, const Pattern& pattern, State* state,
                const Progress* progress) {
  Solver solver(problem, pattern);
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
                       std::uint64_t seed, int threads, const Progress* progress) {
  const auto images = static_cast<int>(cam_from_world.size());
  const Problem problem = MakeProblem(cam_from_world, rays, node_of, tracks,
                                      CoveringTracks(images, tracks, kTracksPerImage));
  const Pattern pattern(problem);
  std::vector<State> states(kStarts);
  std::vector<double> costs(kStarts);
  ParallelFor(0, kStarts, threads, [&](int s) {
    states[s] = RandomStart(problem, HashOf(seed, static_cast<std::uint64_t>(s)));
    costs[s] = Minimise(problem, pattern, &states[s], progress);
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
