#include "calib/sfm/matching/lens_vote.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "calib/sfm/matching/pair_normal.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kK1s[] = {-0.3, -0.18, -0.08, 0, 0.1};
constexpr double kFisheyeK1s[] = {-0.12, -0.06, 0, 0.06};  // of the angle
constexpr double kFarthestOffAxis = 1.4;   // rad; farther off, the plane z = 1 magnifies 30 times
constexpr double kCentreDeviation = 0.01;  // long sides, of the prior
constexpr int kSteps = 25, kReposings = 3;

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

// Unknowns of a lens: the logarithm of the focal length, k1 and the principal point. Nobody asks
// for the last, but where it stays in the middle, what it is off goes into the focal length.
constexpr int kOfLens = 4;
enum LensUnknown { kLogFocal, kRadial, kCentreX, kCentreY };
using Normal = PairNormal<kOfLens>;
using Reduced = Normal::Reduced;
using LensMatrix = Normal::Matrix;
using LensVector = Normal::Vector;

VoteLens Stepped(const VoteLens& lens, const LensVector& step) {
  return {lens.focal * std::exp(step[kLogFocal]), lens.k1 + step[kRadial], lens.fisheye,
          lens.centre + step.tail<2>()};
}

Normal NormalOfLens(const VotePair& pair, const VoteLens& lens, const RelativePose& pose) {
  std::array<LensPair, kOfLens> nearby;
  for (int k = 0; k < kOfLens; ++k) {
    const VoteLens stepped = Stepped(lens, kLensStep * LensVector::Unit(k));
    nearby[static_cast<size_t>(k)] = {stepped, stepped};
  }
  return NormalOf<kOfLens>(pair, {lens, lens}, nearby, pose);
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
    Minimise(kSteps, options_.progress, cost_, [&](double damping) { return Step(damping); });
    VoteResult result;
    result.lens = lens_;
    result.cost = DataCost(lens_, poses_);
    result.log_focal_deviation = Deviation();
    return result;
  }

  // Looks for a better pose of each pair at the lens as it is now; whether that changed anything.
  bool Repose() {
    constexpr double kBetter = 0.999;  // of a pair's cost
    std::vector<char> better(pairs_.size());
    ParallelFor(0, static_cast<int>(pairs_.size()), [&](int i) {
      const auto p = static_cast<size_t>(i);
      if (options_.progress != nullptr) options_.progress->ThrowIfInterrupted();
      const Posed posed = Reposed(pairs_[p], {lens_, lens_});
      const double now = CostOf(Unbend({lens_, lens_}, pairs_[p].points, kScale), poses_[p]);
      if (!(posed.cost < kBetter * now)) return;
      poses_[p] = posed.pose;
      better[p] = 1;
    });
    cost_ = Cost(lens_, poses_);
    return std::count(better.begin(), better.end(), 1) > 0;
  }

 private:
  double DataCost(const VoteLens& lens, const std::vector<RelativePose>& poses) const {
    double cost = 0;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      cost += CostOf(Unbend({lens, lens}, pairs_[p].points, kScale), poses[p]);
    }
    return cost;
  }

  // What the priors weigh, and where a lens stands from what they say.
  static LensVector PriorWeights() {
    const LensVector deviations(kLogFocalDeviation, kK1Deviation, kCentreDeviation,
                                kCentreDeviation);
    return kPriorNoise * kPriorNoise * deviations.cwiseAbs2().cwiseInverse();
  }
  LensVector OffPriors(const VoteLens& lens) const {
    return {std::log(lens.focal / options_.prior_focal), lens.k1, lens.centre.x(), lens.centre.y()};
  }

  double Cost(const VoteLens& lens, const std::vector<RelativePose>& poses) const {
    return DataCost(lens, poses) + PriorWeights().dot(OffPriors(lens).cwiseAbs2());
  }

  // The reduced system of the lens with its priors, and what each pair gives.
  void Reduce(double damping, LensMatrix& h, LensVector& g, std::vector<Normal>& normals) const {
    h = PriorWeights().asDiagonal();
    g = PriorWeights().cwiseProduct(OffPriors(lens_));
    const auto add = [&](const Reduced& of_pair) {
      h += of_pair.h;
      g += of_pair.g;
    };
    normals.resize(pairs_.size());
    ParallelFor(0, static_cast<int>(pairs_.size()), [&](int i) {
      const auto p = static_cast<size_t>(i);
      normals[p] = NormalOfLens(pairs_[p], lens_, poses_[p]);
    });
    for (Normal& n : normals) {
      n.DampPose(damping);
      add(n.WithoutPose());
    }
    FixUnasked(h, g);
    h.diagonal() *= 1 + damping;
  }

  // Unknowns that hold take no part.
  void FixUnasked(LensMatrix& h, LensVector& g) const {
    for (const auto& [unknown, fixed] : {std::pair(kLogFocal, options_.focal_is_fixed),
                                         std::pair(kRadial, options_.k1_is_fixed)}) {
      if (!fixed) continue;
      h.row(unknown).setZero();
      h.col(unknown).setZero();
      h(unknown, unknown) = 1;
      g[unknown] = 0;
    }
  }

  bool Step(double damping) {
    LensMatrix h;
    LensVector g;
    std::vector<Normal> normals;
    Reduce(damping, h, g, normals);
    LensVector step = -h.ldlt().solve(g);
    if (!step.allFinite()) return false;
    step /= std::max({1.0, std::abs(step[kLogFocal]) / 0.3, std::abs(step[kRadial]) / 0.1});
    const VoteLens lens = Stepped(lens_, step);
    std::vector<RelativePose> poses;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      poses.push_back(PoseDerivatives(poses_[p]).Moved(normals[p].PoseStep(step)));
    }
    const double cost = Cost(lens, poses);
    if (!(cost < cost_)) return false;
    lens_ = lens;
    poses_ = std::move(poses);
    cost_ = cost;
    return true;
  }

  double Deviation() const {
    LensMatrix h;
    LensVector g;
    std::vector<Normal> normals;
    Reduce(0, h, g, normals);
    const double noise = NoiseVariance(normals);
    if (!std::isfinite(noise)) return noise;
    const double by_matches = h.inverse()(0, 0) * noise;
    return std::sqrt(std::max({0.0, by_matches, VarianceByPhotos(h, normals)}));
  }

  // What matches tell of the lens is wrong in the same way all over a pair, and in pairs that share
  // a photo: one Newton step from the solution tells what it becomes without a photo's pairs. The
  // jackknife over the nodes of a graph (Snijders and Borgatti, Connections 1999).
  double VarianceByPhotos(const LensMatrix& h, const std::vector<Normal>& normals) const {
    std::map<int, Reduced> of_photo;
    for (size_t p = 0; p < pairs_.size(); ++p) {
      const Reduced reduced = normals[p].WithoutPose();
      for (const int photo : {pairs_[p].photo_a, pairs_[p].photo_b}) {
        of_photo[photo].h += reduced.h;
        of_photo[photo].g += reduced.g;
      }
    }
    const auto count = static_cast<double>(of_photo.size());
    if (count < 3) return 0;  // without one of two photos nothing is left
    double sum = 0;
    for (auto& [photo, reduced] : of_photo) {
      LensMatrix left = h - reduced.h;
      FixUnasked(left, reduced.g);
      const double change = left.ldlt().solve(reduced.g)[kLogFocal];
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
  const Eigen::Vector2d bent = (p - lens.centre) / lens.focal;
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
  ParallelFor(0, static_cast<int>(pairs.size()), [&](int p) {
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
  Joint joint(pairs, options, lenses[best], std::move(poses));
  VoteResult result = joint.Solve();
  for (int k = 0; k < kReposings && joint.Repose(); ++k) result = joint.Solve();
  return result;
}

}  // namespace dtr::sfm::matching
