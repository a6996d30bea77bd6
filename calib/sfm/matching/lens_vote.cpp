#include "calib/sfm/matching/lens_vote.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "calib/sfm/matching/lens_pair.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kK1s[] = {-0.3, -0.18, -0.08, 0, 0.1};
constexpr double kFisheyeK1s[] = {-0.12, -0.06, 0, 0.06};  // of the angle
constexpr double kFarthestOffAxis = 1.4;  // rad; farther off, the plane z = 1 magnifies 30 times
constexpr int kSteps = 25;

std::vector<VoteLens> Grid(const VoteOptions& options) {
  std::vector<VoteLens> lenses;
  const bool fisheye = options.fisheye;
  for (const double k1 : fisheye ? std::span<const double>(kFisheyeK1s) : kK1s) {
    if (options.k1_is_fixed && k1 != 0) continue;
    if (options.focal_is_fixed) {
      lenses.push_back({options.prior_focal, k1, fisheye});
      continue;
    }
    for (const double focal : FocalGrid(fisheye)) lenses.push_back({focal, k1, fisheye});
  }
  return lenses;
}

// Normal equations of a pair: pose and lens.
struct Normal {
  Eigen::Matrix<double, 7, 7> h = Eigen::Matrix<double, 7, 7>::Zero();
  Eigen::Matrix<double, 7, 1> g = Eigen::Matrix<double, 7, 1>::Zero();
  double weights = 0, squares = 0;
};

// Of the lens alone, the pose eliminated.
struct Reduced {
  Eigen::Matrix2d h = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
};

Reduced ReducedOf(const Normal& n) {
  const auto pose = n.h.topLeftCorner<5, 5>().ldlt();
  const Eigen::Matrix<double, 5, 2> across = n.h.topRightCorner<5, 2>();
  return {n.h.bottomRightCorner<2, 2>() - across.transpose() * pose.solve(across),
          n.g.tail<2>() - across.transpose() * pose.solve(n.g.head<5>())};
}

Normal NormalOf(const VotePair& pair, const VoteLens& lens, const RelativePose& pose) {
  constexpr double kStep = 1e-5;
  Normal normal;
  const PoseDerivatives at(pose);
  const VoteLens nearby[2] = {Stepped(lens, kStep, 0), Stepped(lens, 0, kStep)};
  const auto residual = [&](const VoteLens& by, size_t i, PoseRow* row, double& scale) {
    double ma = 1, mb = 1;
    const auto a = Unbent(by, pair.points.a[i], &ma), b = Unbent(by, pair.points.b[i], &mb);
    if (!a || !b) return std::numeric_limits<double>::quiet_NaN();
    scale = kScale * std::sqrt(ma * mb);
    return at.Residual(*a, *b, row) / scale;
  };
  for (size_t i = 0; i < pair.points.size(); ++i) {
    PoseRow pose_row;
    double scale = 1, other = 1;
    const double r = residual(lens, i, &pose_row, scale);
    if (!std::isfinite(r)) continue;
    const double root = 1 / (1 + r * r), weight = root * root;
    if (weight < 1e-3) continue;
    Eigen::Matrix<double, 7, 1> row;
    row.head<5>() = pose_row.transpose() / scale;
    for (int k = 0; k < 2; ++k) {
      const double moved = residual(nearby[k], i, nullptr, other);
      row[5 + k] = std::isfinite(moved) ? (moved - r) / kStep : 0;
    }
    normal.h.noalias() += weight * row * row.transpose();
    normal.g += weight * r * row;
    normal.weights += weight;
    normal.squares += weight * r * r;
  }
  return normal;
}

// Lens and poses together.
class Joint {
 public:
  Joint(const std::vector<VotePair>& pairs, const VoteOptions& options, const VoteLens& lens,
        std::vector<RelativePose> poses)
      : pairs_(pairs), options_(options), lens_(lens), poses_(std::move(poses)) {
    cost_ = Cost(lens_, poses_);
  }

  VoteResult Solve() {
    double damping = 1e-3;
    for (int k = 0; k < kSteps && damping < 1e6; ++k) {
      if (options_.progress != nullptr) options_.progress->ThrowIfInterrupted();
      const double before = cost_;
      if (!Step(damping)) {
        damping *= 10;
        continue;
      }
      damping *= 0.2;
      if (before - cost_ < 1e-7 * before) break;
    }
    VoteResult result;
    result.lens = lens_;
    result.cost = DataCost(lens_, poses_);
    result.log_focal_deviation = Deviation();
    return result;
  }

 private:
  double DataCost(const VoteLens& lens, const std::vector<RelativePose>& poses) const {
    double cost = 0;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      cost += CostOf(Unbend({lens, lens}, pairs_[p].points, kScale), poses[p]);
    }
    return cost;
  }

  double Cost(const VoteLens& lens, const std::vector<RelativePose>& poses) const {
    const double f = std::log(lens.focal / options_.prior_focal) / kLogFocalDeviation;
    const double k = lens.k1 / kK1Deviation;
    return DataCost(lens, poses) + kPriorNoise * kPriorNoise * (f * f + k * k);
  }

  // The reduced system of the lens (2 x 2) with its priors, and what each pair gives.
  void Reduce(double damping, Eigen::Matrix2d& h, Eigen::Vector2d& g,
              std::vector<Normal>& normals) const {
    const double noise = kPriorNoise * kPriorNoise;
    const double f = noise / (kLogFocalDeviation * kLogFocalDeviation);
    const double k = noise / (kK1Deviation * kK1Deviation);
    h = Eigen::Vector2d(f, k).asDiagonal();
    g << f * std::log(lens_.focal / options_.prior_focal), k * lens_.k1;
    const auto add = [&](const Reduced& of_pair) {
      h += of_pair.h;
      g += of_pair.g;
    };
    normals.resize(pairs_.size());
    ParallelFor(0, static_cast<int>(pairs_.size()), options_.threads, [&](int i) {
      const auto p = static_cast<size_t>(i);
      normals[p] = NormalOf(pairs_[p], lens_, poses_[p]);
    });
    for (Normal& n : normals) {
      n.h.diagonal().head<5>() *= 1 + damping;
      n.h.diagonal().head<5>().array() += 1e-9;
      add(ReducedOf(n));
    }
    if (options_.focal_is_fixed) Fix(0, h, g);
    if (options_.k1_is_fixed) Fix(1, h, g);
    h.diagonal() *= 1 + damping;
  }

  static void Fix(int i, Eigen::Matrix2d& h, Eigen::Vector2d& g) {
    h.row(i).setZero();
    h.col(i).setZero();
    h(i, i) = 1;
    g[i] = 0;
  }

  bool Step(double damping) {
    Eigen::Matrix2d h;
    Eigen::Vector2d g;
    std::vector<Normal> normals;
    Reduce(damping, h, g, normals);
    Eigen::Vector2d step = -h.ldlt().solve(g);
    if (!step.allFinite()) return false;
    const double shorten = std::max({1.0, std::abs(step[0]) / 0.3, std::abs(step[1]) / 0.1});
    step /= shorten;
    const VoteLens lens = Stepped(lens_, step[0], step[1]);
    std::vector<RelativePose> poses;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      const Normal& n = normals[p];
      const Eigen::Matrix<double, 5, 1> right = n.g.head<5>() + n.h.topRightCorner<5, 2>() * step;
      Eigen::Matrix<double, 5, 1> move = -n.h.topLeftCorner<5, 5>().ldlt().solve(right);
      if (!move.allFinite()) move.setZero();
      poses.push_back(PoseDerivatives(poses_[p]).Moved(move));
    }
    const double cost = Cost(lens, poses);
    if (!(cost < cost_)) return false;
    lens_ = lens;
    poses_ = std::move(poses);
    cost_ = cost;
    return true;
  }

  double Deviation() const {
    Eigen::Matrix2d h;
    Eigen::Vector2d g;
    std::vector<Normal> normals;
    Reduce(0, h, g, normals);
    double weights = 0, squares = 0;
    for (const Normal& n : normals) {
      weights += n.weights;
      squares += n.squares;
    }
    if (!(weights > 0)) return std::numeric_limits<double>::infinity();
    const double by_matches = h.inverse()(0, 0) * squares / weights;
    return std::sqrt(std::max({0.0, by_matches, VarianceByPhotos(h, normals)}));
  }

  // What matches tell of the lens is wrong in the same way all over a pair, and in pairs that share
  // a photo: one Newton step from the solution tells what it becomes without a photo's pairs. The
  // jackknife over the nodes of a graph (Snijders and Borgatti, Connections 1999).
  double VarianceByPhotos(const Eigen::Matrix2d& h, const std::vector<Normal>& normals) const {
    std::map<int, Reduced> of_photo;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      const Reduced reduced = ReducedOf(normals[p]);
      for (const int photo : {pairs_[p].photo_a, pairs_[p].photo_b}) {
        of_photo[photo].h += reduced.h;
        of_photo[photo].g += reduced.g;
      }
    }
    const auto count = static_cast<double>(of_photo.size());
    if (count < 3) return 0;  // without one of two photos nothing is left
    double sum = 0;
    for (auto& [photo, reduced] : of_photo) {
      if (options_.focal_is_fixed) Fix(0, reduced.h, reduced.g);
      if (options_.k1_is_fixed) Fix(1, reduced.h, reduced.g);
      Eigen::Matrix2d left = h - reduced.h;
      for (int i = 0; i < 2; ++i) {
        if (i == 0 ? options_.focal_is_fixed : options_.k1_is_fixed) left(i, i) = 1;
      }
      const double change = left.ldlt().solve(reduced.g)[0];
      if (std::isfinite(change)) sum += change * change;
    }
    return (count - 2) / (2 * count) * sum;
  }

  const std::vector<VotePair>& pairs_;
  const VoteOptions& options_;
  VoteLens lens_;
  std::vector<RelativePose> poses_;
  double cost_ = 0;
};

}  // namespace

std::optional<Eigen::Vector2d> Unbent(const VoteLens& lens, const Eigen::Vector2d& p,
                                      double* magnification) {
  const Eigen::Vector2d bent = p / lens.focal;
  const double target = bent.norm();
  if (lens.k1 < 0 && target > 0.98 * 2.0 / 3 / std::sqrt(-3 * lens.k1)) return std::nullopt;
  double r = target;
  for (int i = 0; i < 20; ++i) {
    const double step = (r * (1 + lens.k1 * r * r) - target) / (1 + 3 * lens.k1 * r * r);
    r -= step;
    if (std::abs(step) < 1e-13) break;
  }
  if (!std::isfinite(r)) return std::nullopt;
  double tangential = 1 / (1 + lens.k1 * r * r), radial = 1 / (1 + 3 * lens.k1 * r * r);
  if (!(radial > 0) || !(tangential > 0)) return std::nullopt;
  if (lens.fisheye && r > 0) {  // r is the angle; its tangent is on the plane
    if (r > kFarthestOffAxis) return std::nullopt;
    const double slope = std::tan(r);
    tangential *= slope / r;
    radial *= 1 + slope * slope;
  }
  if (magnification != nullptr) *magnification = std::sqrt(tangential * radial) / lens.focal;
  return bent * tangential;
}

std::optional<VoteResult> VoteOnLens(const std::vector<VotePair>& pairs,
                                     const VoteOptions& options) {
  if (pairs.empty()) return std::nullopt;
  const std::vector<VoteLens> lenses = Grid(options);
  std::vector<LensPair> of_pairs;
  for (const VoteLens& lens : lenses) of_pairs.push_back({lens, lens});
  std::vector<std::vector<Posed>> posed(pairs.size());
  ParallelFor(0, static_cast<int>(pairs.size()), options.threads, [&](int p) {
    if (options.progress != nullptr) options.progress->ThrowIfInterrupted();
    posed[static_cast<size_t>(p)] = OverLenses(pairs[static_cast<size_t>(p)], of_pairs);
  });
  size_t best = 0;
  double best_cost = std::numeric_limits<double>::infinity();
  for (size_t l = 0; l < lenses.size(); ++l) {
    double cost = 0;
    for (const auto& of_pair : posed) cost += of_pair[l].cost;
    if (cost < best_cost) {
      best_cost = cost;
      best = l;
    }
  }
  std::vector<RelativePose> poses;
  for (const auto& of_pair : posed) poses.push_back(of_pair[best].pose);
  return Joint(pairs, options, lenses[best], std::move(poses)).Solve();
}

}  // namespace dtr::sfm::matching
