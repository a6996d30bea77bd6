#include "calib/sfm/matching/zoom_vote.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/sfm/matching/pair_normal.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm::matching {
namespace {

constexpr int kZoomSteps = 30, kMaxTurns = 20;
// Most photos were not zoomed: one that is off the common focal length by more than 3 % costs as
// much as so many matches that nothing explains.
constexpr double kZoomCost = 4, kLogSameFocal = 0.03;

// The photos of the pairs, in order, and the pairs by their places in that.
struct ZoomGraph {
  std::vector<int> photos;
  std::vector<std::pair<size_t, size_t>> ends;
};

ZoomGraph GraphOf(const std::vector<VotePair>& pairs) {
  ZoomGraph graph;
  for (const VotePair& pair : pairs) {
    graph.photos.insert(graph.photos.end(), {pair.photo_a, pair.photo_b});
  }
  std::sort(graph.photos.begin(), graph.photos.end());
  graph.photos.erase(std::unique(graph.photos.begin(), graph.photos.end()), graph.photos.end());
  const auto place_of = [&](int photo) {
    return static_cast<size_t>(std::lower_bound(graph.photos.begin(), graph.photos.end(), photo) -
                               graph.photos.begin());
  };
  for (const VotePair& pair : pairs) {
    graph.ends.emplace_back(place_of(pair.photo_a), place_of(pair.photo_b));
  }
  return graph;
}

// Costs and poses of every pair for all focal lengths of a grid, row by row of its first photo's.
struct GridCosts {
  std::vector<double> focals;
  std::vector<std::vector<Posed>> pairs;
  const Posed& At(size_t pair, size_t a, size_t b) const {
    return pairs[pair][a * focals.size() + b];
  }
};

GridCosts CostsOf(const std::vector<VotePair>& pairs, const VoteOptions& options) {
  GridCosts costs{FocalGrid(options.fisheye), std::vector<std::vector<Posed>>(pairs.size())};
  std::vector<LensPair> lenses;
  for (const double a : costs.focals) {
    for (const double b : costs.focals) {
      lenses.push_back({{a, 0, options.fisheye}, {b, 0, options.fisheye}});
    }
  }
  ParallelFor(0, static_cast<int>(pairs.size()), [&](int p) {
    if (options.progress != nullptr) options.progress->ThrowIfInterrupted();
    costs.pairs[static_cast<size_t>(p)] = OverLenses(pairs[static_cast<size_t>(p)], lenses);
  });
  return costs;
}

// Per photo, an index into the grid.
using Labels = std::vector<size_t>;

// Photos take the label that suits their pairs best, in turn, until none changes; another than
// `common` is a zoom.
void TakeTurns(const ZoomGraph& graph, const GridCosts& costs, size_t common, Labels& labels) {
  std::vector<std::vector<size_t>> pairs_of(graph.photos.size());
  for (size_t p = 0; p < graph.ends.size(); ++p) {
    pairs_of[graph.ends[p].first].push_back(p);
    pairs_of[graph.ends[p].second].push_back(p);
  }
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    bool changed = false;
    for (size_t photo = 0; photo < labels.size(); ++photo) {
      const auto cost_at = [&](size_t label) {
        double cost = label == common ? 0 : kZoomCost;
        for (const size_t p : pairs_of[photo]) {
          const auto [a, b] = graph.ends[p];
          cost += costs.At(p, a == photo ? label : labels[a], b == photo ? label : labels[b]).cost;
        }
        return cost;
      };
      size_t best = labels[photo];
      double least = cost_at(best);
      for (size_t label = 0; label < costs.focals.size(); ++label) {
        const double cost = cost_at(label);
        if (!(cost < least)) continue;
        least = cost;
        best = label;
      }
      changed = changed || best != labels[photo];
      labels[photo] = best;
    }
    if (!changed) return;
  }
}

// What photos settle on from each label in common. Wide as the grid's scale is, the best of them
// is not surely the start of the best solution.
std::vector<std::pair<size_t, Labels>> Starts(const ZoomGraph& graph, const GridCosts& costs) {
  std::vector<std::pair<size_t, Labels>> starts;
  for (size_t common = 0; common < costs.focals.size(); ++common) {
    Labels labels(graph.photos.size(), common);
    TakeTurns(graph, costs, common, labels);
    const auto same = [&](const auto& start) { return start.second == labels; };
    if (std::any_of(starts.begin(), starts.end(), same)) continue;
    starts.emplace_back(common, std::move(labels));
  }
  return starts;
}

// Unknowns of a pair's lenses: both focal lengths, k1.
constexpr int kOfLenses = 3;
using Normal = PairNormal<kOfLenses>;

Normal NormalOfZoom(const VotePair& pair, const LensPair& at, const RelativePose& pose) {
  return NormalOf<kOfLenses>(pair, at,
                             {{{Stepped(at.a, kLensStep, 0), at.b},
                               {at.a, Stepped(at.b, kLensStep, 0)},
                               {Stepped(at.a, 0, kLensStep), Stepped(at.b, 0, kLensStep)}}},
                             pose);
}

// All focal lengths, k1 and poses together; the last unknowns are k1 and the common focal length.
class ZoomSolve {
 public:
  struct State {
    std::vector<double> focals;
    double common = 1, k1 = 0;
    std::vector<RelativePose> poses;
  };

  ZoomSolve(const std::vector<VotePair>& pairs, const ZoomGraph& graph, const VoteOptions& options,
            State start)
      : pairs_(pairs), graph_(graph), options_(options), state_(std::move(start)) {
    start_common_ = state_.common;
    cost_ = Cost(state_);
  }

  double cost() const { return cost_; }  // with what priors cost

  ZoomResult Solve() {
    Minimise(kZoomSteps, options_.progress, cost_, [&](double damping) { return Step(damping); });
    ZoomResult result;
    result.k1 = state_.k1;
    result.cost = DataCost(state_);
    const std::vector<double> deviations = Deviations();
    for (size_t i = 0; i < graph_.photos.size(); ++i) {
      result.photos[graph_.photos[i]] = {state_.focals[i], deviations[i]};
    }
    return result;
  }

 private:
  LensPair LensesOf(const State& state, size_t pair) const {
    const auto [a, b] = graph_.ends[pair];
    return {{state.focals[a], state.k1, options_.fisheye},
            {state.focals[b], state.k1, options_.fisheye}};
  }

  double DataCost(const State& state) const {
    double cost = 0;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      cost += CostOf(Unbend(LensesOf(state, p), pairs_[p].points, kScale), state.poses[p]);
    }
    return cost;
  }

  double Cost(const State& state) const {
    const double squares = std::pow(state.k1 / kK1Deviation, 2) +
                           std::pow(std::log(state.common / start_common_) / kLogFocalDeviation, 2);
    double zooms = 0;
    for (const double focal : state.focals) {
      zooms += RobustCost(std::pow(std::log(focal / state.common) / kLogSameFocal, 2));
    }
    return DataCost(state) + kPriorNoise * kPriorNoise * squares + kZoomCost * zooms;
  }

  // The reduced system of focal lengths and k1 with their priors, poses eliminated.
  void Reduce(double damping, Eigen::MatrixXd& h, Eigen::VectorXd& g,
              std::vector<Normal>& normals) const {
    const auto photos = static_cast<long>(graph_.photos.size());
    const double noise = kPriorNoise * kPriorNoise;
    h = Eigen::MatrixXd::Zero(photos + 2, photos + 2);
    g = Eigen::VectorXd::Zero(photos + 2);
    h(photos, photos) = noise / (kK1Deviation * kK1Deviation);
    g[photos] = h(photos, photos) * state_.k1;
    h(photos + 1, photos + 1) = noise / (kLogFocalDeviation * kLogFocalDeviation);
    g[photos + 1] = h(photos + 1, photos + 1) * std::log(state_.common / start_common_);
    for (long i = 0; i < photos; ++i) AddZoom(i, photos + 1, h, g);
    normals.resize(pairs_.size());
    ParallelFor(0, static_cast<int>(pairs_.size()), [&](int i) {
      const auto p = static_cast<size_t>(i);
      normals[p] = NormalOfZoom(pairs_[p], LensesOf(state_, p), state_.poses[p]);
    });
    for (size_t p = 0; p < normals.size(); ++p) {
      normals[p].DampPose(damping);
      AddReduced(normals[p].WithoutPose(), p, photos, h, g);
    }
    for (long i = 0; i < photos + 2; ++i) {
      if (i != photos ? options_.focal_is_fixed : options_.k1_is_fixed) Fix(i, h, g);
    }
    h.diagonal() *= 1 + damping;
  }

  void AddZoom(long photo, long common, Eigen::MatrixXd& h, Eigen::VectorXd& g) const {
    const double r =
        std::log(state_.focals[static_cast<size_t>(photo)] / state_.common) / kLogSameFocal;
    const double root = 1 / (1 + r * r), weight = kZoomCost * root * root / kLogSameFocal;
    h(photo, photo) += weight / kLogSameFocal + 1e-9;
    h(common, common) += weight / kLogSameFocal;
    h(photo, common) -= weight / kLogSameFocal;
    h(common, photo) -= weight / kLogSameFocal;
    g[photo] += weight * r;
    g[common] -= weight * r;
  }

  void AddReduced(const Normal::Reduced& reduced, size_t pair, long photos, Eigen::MatrixXd& h,
                  Eigen::VectorXd& g) const {
    const long at[kOfLenses] = {static_cast<long>(graph_.ends[pair].first),
                                static_cast<long>(graph_.ends[pair].second), photos};
    for (int i = 0; i < kOfLenses; ++i) {
      g[at[i]] += reduced.g[i];
      for (int j = 0; j < kOfLenses; ++j) h(at[i], at[j]) += reduced.h(i, j);
    }
  }

  static void Fix(long i, Eigen::MatrixXd& h, Eigen::VectorXd& g) {
    h.row(i).setZero();
    h.col(i).setZero();
    h(i, i) = 1;
    g[i] = 0;
  }

  bool Step(double damping) {
    Eigen::MatrixXd h;
    Eigen::VectorXd g;
    std::vector<Normal> normals;
    Reduce(damping, h, g, normals);
    Eigen::VectorXd step = -h.ldlt().solve(g);
    if (!step.allFinite()) return false;
    const long photos = step.size() - 2;
    const double shorten =
        std::max({1.0, step.head(photos).cwiseAbs().maxCoeff() / 0.3, std::abs(step[photos]) / 0.1,
                  std::abs(step[photos + 1]) / 0.3});
    step /= shorten;
    State moved = state_;
    for (long i = 0; i < photos; ++i) moved.focals[static_cast<size_t>(i)] *= std::exp(step[i]);
    moved.k1 += step[photos];
    moved.common *= std::exp(step[photos + 1]);
    for (size_t p = 0; p < normals.size(); ++p) {
      const Normal::Vector of_pair(step[static_cast<long>(graph_.ends[p].first)],
                                   step[static_cast<long>(graph_.ends[p].second)], step[photos]);
      moved.poses[p] = PoseDerivatives(state_.poses[p]).Moved(normals[p].PoseStep(of_pair));
    }
    const double cost = Cost(moved);
    if (!(cost < cost_)) return false;
    state_ = std::move(moved);
    cost_ = cost;
    return true;
  }

  std::vector<double> Deviations() const {
    Eigen::MatrixXd h;
    Eigen::VectorXd g;
    std::vector<Normal> normals;
    Reduce(0, h, g, normals);
    const double noise = NoiseVariance(normals);
    std::vector<double> deviations(graph_.photos.size(), std::numeric_limits<double>::infinity());
    if (!std::isfinite(noise)) return deviations;
    const Eigen::MatrixXd inverse = h.ldlt().solve(Eigen::MatrixXd::Identity(h.rows(), h.cols()));
    for (size_t i = 0; i < deviations.size(); ++i) {
      const double variance = inverse(static_cast<long>(i), static_cast<long>(i)) * noise;
      if (variance >= 0) deviations[i] = std::sqrt(variance);
    }
    return deviations;
  }

  const std::vector<VotePair>& pairs_;
  const ZoomGraph& graph_;
  const VoteOptions& options_;
  State state_;
  double start_common_ = 1;
  double cost_ = 0;
};

}  // namespace

std::optional<ZoomResult> VoteOnZoom(const std::vector<VotePair>& pairs,
                                     const VoteOptions& options) {
  if (pairs.empty()) return std::nullopt;
  const ZoomGraph graph = GraphOf(pairs);
  const GridCosts costs = CostsOf(pairs, options);
  std::optional<ZoomResult> best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [common, labels] : Starts(graph, costs)) {
    ZoomSolve::State start;
    start.common = costs.focals[common];
    for (const size_t label : labels) start.focals.push_back(costs.focals[label]);
    for (size_t p = 0; p < pairs.size(); ++p) {
      const auto [a, b] = graph.ends[p];
      start.poses.push_back(costs.At(p, labels[a], labels[b]).pose);
    }
    ZoomSolve solve(pairs, graph, options, std::move(start));
    ZoomResult result = solve.Solve();
    if (!(solve.cost() < least)) continue;
    least = solve.cost();
    best = std::move(result);
  }
  return best;
}

std::optional<ZoomResult> CostOfFocals(const std::vector<VotePair>& pairs,
                                       const std::map<int, double>& focals,
                                       const VoteOptions& options) {
  if (pairs.empty()) return std::nullopt;
  const ZoomGraph graph = GraphOf(pairs);
  ZoomSolve::State start;
  for (const int photo : graph.photos) start.focals.push_back(focals.at(photo));
  for (size_t p = 0; p < pairs.size(); ++p) {
    const auto [a, b] = graph.ends[p];
    const LensPair lenses{{start.focals[a], 0, options.fisheye},
                          {start.focals[b], 0, options.fisheye}};
    start.poses.push_back(OverLenses(pairs[p], {lenses}).front().pose);
  }
  VoteOptions held = options;
  held.focal_is_fixed = true;
  return ZoomSolve(pairs, graph, held, std::move(start)).Solve();
}

}  // namespace dtr::sfm::matching
