#include "calib/sfm/mapping/rotation_averaging.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/sfm/mapping/so3.h"

namespace dtr::sfm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMaxTriplets = 40;
constexpr double kClosesAtSigmas = 4;
constexpr int kL1Iterations = 15, kRobustIterations = 15;
constexpr double kRobustSigmas = 3;
constexpr double kSettledRad = 1e-5;

struct Edge {
  int to = 0, pair = 0;
};

std::vector<std::vector<Edge>> EdgesOf(int images, std::span<const RelativeRotation> pairs) {
  std::vector<std::vector<Edge>> edges(images);
  for (size_t p = 0; p < pairs.size(); ++p) {
    edges[pairs[p].image_a].push_back({pairs[p].image_b, static_cast<int>(p)});
    edges[pairs[p].image_b].push_back({pairs[p].image_a, static_cast<int>(p)});
  }
  for (auto& list : edges) {
    std::sort(list.begin(), list.end(), [](const Edge& x, const Edge& y) { return x.to < y.to; });
  }
  return edges;
}

Matrix3d WithFloor(const Matrix3d& covariance) {
  return covariance + kRotationFloorRad * kRotationFloorRad * Matrix3d::Identity();
}

// A pair's rotation, leading from image `from`.
struct Directed {
  Matrix3d rotation, covariance;
};
Directed Forwards(const MatchedPose& pose) { return {pose.b_from_a, WithFloor(pose.covariance)}; }
Directed FromEnd(const MatchedPose& pose, bool from_a) {
  const Directed ab = Forwards(pose);
  if (from_a) return ab;
  // The inverse of exp(w) R is exp(-R^T w) R^T.
  return {ab.rotation.transpose(), ab.rotation.transpose() * ab.covariance * ab.rotation};
}
Directed From(const RelativeRotation& pair, int from) {
  return FromEnd(pair, pair.image_a == from);
}

bool Closes(const Directed& ab, const Directed& bc, const Directed& ca) {
  const Matrix3d ca_bc = ca.rotation * bc.rotation;
  const Vector3d error = LogOf(ca_bc * ab.rotation);
  const Matrix3d covariance = ca.covariance +
                              ca.rotation * bc.covariance * ca.rotation.transpose() +
                              ca_bc * ab.covariance * ca_bc.transpose();
  return error.dot(covariance.ldlt().solve(error)) < kClosesAtSigmas * kClosesAtSigmas;
}

// The cycles of three pairs that each pair is part of.
class Triplets {
 public:
  Triplets(int images, std::span<const RelativeRotation> pairs)
      : pairs_(pairs), edges_(EdgesOf(images, pairs)) {}

  // The two other pairs of each: those with the most matches first, kMaxTriplets of them.
  std::vector<std::pair<int, int>> Of(size_t p) const {
    const auto &of_a = edges_[pairs_[p].image_a], &of_b = edges_[pairs_[p].image_b];
    std::vector<std::pair<int, std::pair<int, int>>> common;
    for (size_t i = 0, k = 0; i < of_a.size() && k < of_b.size();) {
      if (of_a[i].to == of_b[k].to) {
        const int weakest = std::min(pairs_[of_a[i].pair].matches, pairs_[of_b[k].pair].matches);
        common.push_back({-weakest, {of_a[i].pair, of_b[k].pair}});
        ++i, ++k;
      } else {
        of_a[i].to < of_b[k].to ? ++i : ++k;
      }
    }
    std::sort(common.begin(), common.end());
    if (common.size() > kMaxTriplets) common.resize(kMaxTriplets);
    std::vector<std::pair<int, int>> legs;
    for (const auto& [matches, of_triplet] : common) legs.push_back(of_triplet);
    return legs;
  }

  // Whether one of them closes with these poses of the pair and its legs.
  bool IsClosed(size_t p, const std::pair<int, int>& legs, const MatchedPose& pose,
                const MatchedPose& pose_a, const MatchedPose& pose_b) const {
    const int a = pairs_[p].image_a, b = pairs_[p].image_b;
    return Closes(Forwards(pose), FromEnd(pose_b, pairs_[legs.second].image_a == b),
                  FromEnd(pose_a, pairs_[legs.first].image_a != a));
  }

 private:
  std::span<const RelativeRotation> pairs_;
  std::vector<std::vector<Edge>> edges_;
};

// Decides which of its two poses each pair takes, so that as many triplets close as can be.
class TwinChoice {
 public:
  using Twins = std::vector<char>;  // per pair: whether it takes its twin

  TwinChoice(int images, std::span<const RelativeRotation> pairs)
      : pairs_(pairs), cycles_(pairs.size()) {
    const Triplets triplets(images, pairs);
    for (size_t p = 0; p < pairs.size(); ++p) {
      for (const auto& legs : triplets.Of(p)) {
        if (!pairs[p].twin && !pairs[legs.first].twin && !pairs[legs.second].twin) continue;
        const unsigned closed = ClosingPoses(triplets, p, legs);
        if (closed == 0) continue;
        cycles_[p].push_back({legs.first, legs.second, closed});
        ++closable_;
      }
    }
  }

  // Changes single pairs while more of their own triplets close by that.
  Twins Improved(Twins twins) const {
    constexpr int kPasses = 10;
    bool changed = true;
    for (int pass = 0; pass < kPasses && changed; ++pass) {
      changed = false;
      for (size_t p = 0; p < pairs_.size(); ++p) {
        if (!pairs_[p].twin) continue;
        const int before = ClosedOf(p, twins);
        twins[p] ^= 1;
        const bool more = ClosedOf(p, twins) > before;
        if (!more) twins[p] ^= 1;
        changed = changed || more;
      }
    }
    return twins;
  }

  // Begins with both poses of each pair, the twin with weight `of_twin` and the pose with the rest
  // of 1. A weight grows with the triplets that close with it, each times the weights of its other
  // poses (the growth transform of Baum and Eagon 1967).
  Twins Relaxed(double of_twin) const {
    constexpr int kIterations = 30;
    std::vector<double> weights, next;
    for (const RelativeRotation& pair : pairs_) weights.push_back(pair.twin ? of_twin : 0);
    for (int i = 0; i < kIterations; ++i) {
      next = weights;
      for (size_t p = 0; p < pairs_.size(); ++p) {
        if (!pairs_[p].twin) continue;
        const double pose = (1 - weights[p]) * ClosedOf(p, 0, weights);
        const double twin = weights[p] * ClosedOf(p, 1, weights);
        if (pose + twin > 0) next[p] = twin / (pose + twin);
      }
      std::swap(weights, next);
    }
    Twins twins;
    for (const double weight : weights) twins.push_back(weight > 0.5 ? 1 : 0);
    return twins;
  }

  // Triplets with twins that close, counted by each of their pairs; those that some poses close.
  int Closed(const Twins& twins) const {
    int closed = 0;
    for (size_t p = 0; p < pairs_.size(); ++p) closed += ClosedOf(p, twins);
    return closed;
  }
  int closable() const { return closable_; }

 private:
  // Bit k + 2 k_a + 4 k_b is set where the triplet closes with poses k of the pair, k_a and k_b of
  // its legs; 0 is the pose, 1 the twin.
  struct Cycle {
    int leg_a = 0, leg_b = 0;
    unsigned closed = 0;
  };

  unsigned ClosingPoses(const Triplets& triplets, size_t p, const std::pair<int, int>& legs) const {
    const auto pose = [&](size_t pair, unsigned twin) -> const MatchedPose* {
      const RelativeRotation& of = pairs_[pair];
      return twin == 0 ? &of : of.twin ? &*of.twin : nullptr;
    };
    unsigned closed = 0;
    for (unsigned k = 0; k < 8; ++k) {
      const MatchedPose* of_pair = pose(p, k & 1u);
      const MatchedPose* of_a = pose(static_cast<size_t>(legs.first), k >> 1 & 1u);
      const MatchedPose* of_b = pose(static_cast<size_t>(legs.second), k >> 2);
      if (of_pair == nullptr || of_a == nullptr || of_b == nullptr) continue;
      if (triplets.IsClosed(p, legs, *of_pair, *of_a, *of_b)) closed |= 1u << k;
    }
    return closed;
  }

  int ClosedOf(size_t p, const Twins& twins) const {
    unsigned closed = 0;
    for (const Cycle& cycle : cycles_[p]) {
      const int k = twins[p] + 2 * twins[cycle.leg_a] + 4 * twins[cycle.leg_b];
      closed += cycle.closed >> k & 1u;
    }
    return static_cast<int>(closed);
  }

  double ClosedOf(size_t p, unsigned twin, const std::vector<double>& weights) const {
    double closed = 0;
    for (const Cycle& cycle : cycles_[p]) {
      const double a = weights[cycle.leg_a], b = weights[cycle.leg_b];
      for (unsigned k = twin; k < 8; k += 2) {
        if ((cycle.closed >> k & 1u) == 0) continue;
        closed += ((k & 2u) != 0 ? a : 1 - a) * ((k & 4u) != 0 ? b : 1 - b);
      }
    }
    return closed;
  }

  std::span<const RelativeRotation> pairs_;
  std::vector<std::vector<Cycle>> cycles_;
  int closable_ = 0;
};

Vector3d ResidualOf(const RelativeRotation& pair, const std::vector<Matrix3d>& world) {
  return LogOf(pair.b_from_a * world[pair.image_a] * world[pair.image_b].transpose());
}

void StartFromTree(std::span<const RelativeRotation> pairs, std::span<const double> support,
                   const std::vector<std::vector<Edge>>& edges, std::vector<Matrix3d>* world,
                   std::vector<char>* is_root) {
  std::vector<size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto weight = [&](size_t p) { return pairs[p].matches * (0.05 + support[p]); };
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t x, size_t y) { return weight(x) > weight(y); });
  std::vector<int> parent(edges.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<char> in_tree(pairs.size());
  for (const size_t p : order) {
    const int a = root(pairs[p].image_a), b = root(pairs[p].image_b);
    if (a == b) continue;
    parent[a] = b;
    in_tree[p] = 1;
  }
  std::vector<char> reached(edges.size());
  for (size_t first = 0; first < edges.size(); ++first) {
    if (reached[first]) continue;
    (*is_root)[first] = reached[first] = 1;
    std::vector<int> queue{static_cast<int>(first)};
    while (!queue.empty()) {
      const int from = queue.back();
      queue.pop_back();
      for (const Edge& edge : edges[from]) {
        if (!in_tree[edge.pair] || reached[edge.to]) continue;
        reached[edge.to] = 1;
        (*world)[edge.to] = From(pairs[edge.pair], from).rotation * (*world)[from];
        queue.push_back(edge.to);
      }
    }
  }
}

// One reweighted step; returns the largest rotation in it.
class Stepper {
 public:
  Stepper(std::span<const RelativeRotation> pairs, const std::vector<char>& is_root)
      : pairs_(pairs), unknown_(is_root.size(), -1) {
    for (size_t i = 0; i < is_root.size(); ++i) {
      if (!is_root[i]) unknown_[i] = 3 * unknowns_++;
    }
    for (const RelativeRotation& pair : pairs) {
      information_.push_back(WithFloor(pair.covariance).inverse());
    }
  }

  double Step(bool robust, std::vector<Matrix3d>* world) {
    const int size = 3 * unknowns_;
    if (size == 0) return 0;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (size_t p = 0; p < pairs_.size(); ++p) AddPair(p, robust, *world, &entries, &right);
    // What robust weights leave without any pair stays where it is.
    for (int i = 0; i < size; ++i) entries.emplace_back(i, i, 1e-6);
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    if (!analysed_) solver_.analyzePattern(matrix);
    analysed_ = true;
    solver_.factorize(matrix);
    if (solver_.info() != Eigen::Success) return 0;
    const Eigen::VectorXd step = solver_.solve(right);
    if (!step.allFinite()) return 0;
    double largest = 0;
    for (size_t i = 0; i < unknown_.size(); ++i) {
      if (unknown_[i] < 0) continue;
      const Vector3d w = step.segment<3>(unknown_[i]);
      (*world)[i] = Orthonormal(ExpOf(w) * (*world)[i]);
      largest = std::max(largest, w.norm());
    }
    return largest;
  }

  double Misfit(size_t p, const Vector3d& residual) const {
    return std::sqrt(std::max(0.0, residual.dot(information_[p] * residual)));
  }

 private:
  // With images a, b turned by w_a, w_b the residual r becomes r - w_b + R_ba w_a.
  void AddPair(size_t p, bool robust, const std::vector<Matrix3d>& world,
               std::vector<Eigen::Triplet<double>>* entries, Eigen::VectorXd* right) const {
    const RelativeRotation& pair = pairs_[p];
    const Vector3d r = ResidualOf(pair, world);
    const double misfit = Misfit(p, r), share = misfit / kRobustSigmas;
    const double weight =
        robust ? 1 / ((1 + share * share) * (1 + share * share)) : 1 / std::max(misfit, 0.5);
    const Matrix3d h = weight * information_[p];
    const Matrix3d by_a = world[pair.image_b] * world[pair.image_a].transpose();
    const int a = unknown_[pair.image_a], b = unknown_[pair.image_b];
    const auto add = [&](int row, int column, const Matrix3d& block) {
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) entries->emplace_back(row + i, column + k, block(i, k));
      }
    };
    if (a >= 0) {
      add(a, a, by_a.transpose() * h * by_a);
      right->segment<3>(a) -= by_a.transpose() * h * r;
    }
    if (b >= 0) {
      add(b, b, h);
      right->segment<3>(b) += h * r;
    }
    if (a >= 0 && b >= 0) {
      const Matrix3d cross = -h * by_a;  // b down, a across
      add(b, a, cross);
      add(a, b, cross.transpose());
    }
  }

  std::span<const RelativeRotation> pairs_;
  std::vector<int> unknown_;
  int unknowns_ = 0;
  std::vector<Matrix3d> information_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  bool analysed_ = false;
};

}  // namespace

std::vector<double> TripletSupport(int images, std::span<const RelativeRotation> pairs) {
  const Triplets triplets(images, pairs);
  std::vector<double> support(pairs.size(), 0.5);
  for (size_t p = 0; p < pairs.size(); ++p) {
    const auto legs = triplets.Of(p);
    if (legs.empty()) continue;
    const auto closed = std::count_if(legs.begin(), legs.end(), [&](const auto& of) {
      return triplets.IsClosed(p, of, pairs[p], pairs[of.first], pairs[of.second]);
    });
    support[p] = static_cast<double>(closed) / static_cast<double>(legs.size());
  }
  return support;
}

void ChooseTwins(int images, std::vector<RelativeRotation>* pairs) {
  const TwinChoice choice(images, *pairs);
  TwinChoice::Twins best = choice.Improved(TwinChoice::Twins(pairs->size()));
  int closed = choice.Closed(best);
  for (const double of_twin : {0.5, 0.3, 0.7}) {
    if (closed == choice.closable()) break;
    const TwinChoice::Twins twins = choice.Improved(choice.Relaxed(of_twin));
    if (choice.Closed(twins) <= closed) continue;
    best = twins;
    closed = choice.Closed(twins);
  }
  for (size_t p = 0; p < pairs->size(); ++p) {
    if (best[p] != 0) (*pairs)[p].TakeTwin();
  }
}

double MisfitOf(const MatchedPose& pose, const Matrix3d& a_from_world,
                const Matrix3d& b_from_world) {
  const Vector3d r = LogOf(pose.b_from_a * a_from_world * b_from_world.transpose());
  return std::sqrt(std::max(0.0, r.dot(WithFloor(pose.covariance).ldlt().solve(r))));
}

AveragedRotations AverageRotations(int images, std::span<const RelativeRotation> pairs,
                                   std::span<const double> support) {
  AveragedRotations result;
  result.cam_from_world.assign(images, Matrix3d::Identity());
  std::vector<char> is_root(images);
  StartFromTree(pairs, support, EdgesOf(images, pairs), &result.cam_from_world, &is_root);
  Stepper stepper(pairs, is_root);
  for (const bool robust : {false, true}) {
    const int iterations = robust ? kRobustIterations : kL1Iterations;
    for (int i = 0; i < iterations; ++i) {
      if (stepper.Step(robust, &result.cam_from_world) < kSettledRad) break;
    }
  }
  for (size_t p = 0; p < pairs.size(); ++p) {
    const Vector3d r = ResidualOf(pairs[p], result.cam_from_world);
    result.misfit.push_back(stepper.Misfit(p, r));
    result.angle_rad.push_back(r.norm());
  }
  return result;
}

}  // namespace dtr::sfm
