#include "calib/validation/conventions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "calib/residuals.h"
#include "calib/validation/camera_hypotheses.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMaxMatches = 6000;
constexpr int kMaxMistakes = 3;  // one on top of the other
constexpr double kMinSigmas = 6;
constexpr double kMinScalePx = 0.3;       // of Cauchy's loss
constexpr double kExactPx = 0.02;         // residuals below are rounding
constexpr double kLimitShare = 2e-3;      // of the long side: features are found to less
constexpr double kMinParallaxRad = 0.02;  // below, noise decides on which side rays meet
constexpr double kFarShare = 0.25;        // of the long side: a match that contradicts the cameras

struct Match {
  int a = 0, b = 0;
  Vector2d in_a, in_b;
};

// About kMaxMatches, evenly from all.
std::vector<Match> Thinned(std::span<const MatchedPair> pairs) {
  size_t all = 0;
  for (const MatchedPair& pair : pairs) all += pair.pixels.size();
  const size_t step = std::max<size_t>(1, (all + kMaxMatches - 1) / kMaxMatches);
  std::vector<Match> matches;
  size_t i = 0;
  for (const MatchedPair& pair : pairs) {
    for (const auto& [in_a, in_b] : pair.pixels) {
      if (i++ % step == 0) matches.push_back({pair.a, pair.b, in_a, in_b});
    }
  }
  return matches;
}

double LongSide(const LensCamera& lens) { return std::max(lens.width_px, lens.height_px); }

// Sine of the angle between a ray and the epipolar plane of the other ray, both ways, the smaller
// one counted as for Sampson's error; and whether the rays meet in front.
double ResidualPx(const Match& match, std::span<const GivenCamera> cameras) {
  const GivenCamera &a = cameras[static_cast<size_t>(match.a)],
                    &b = cameras[static_cast<size_t>(match.b)];
  const double far_px = kFarShare * LongSide(a.lens);
  const auto ray_a = a.lens.RayFromPixel(match.in_a), ray_b = b.lens.RayFromPixel(match.in_b);
  if (!ray_a || !ray_b) return far_px;
  const Pose b_from_a = b.cam_from_world * a.cam_from_world.Inverse();
  const Vector3d t = b_from_a.translation, turned = b_from_a.rotation * *ray_a;
  if (t.norm() == 0) return far_px;
  const Vector3d plane_in_b = t.cross(turned);  // normal of the epipolar plane of a's ray
  const Vector3d plane_in_a = b_from_a.rotation.conjugate() * t.cross(*ray_b);
  const double value = ray_b->dot(plane_in_b);
  // First-order distance (Sampson) on the unit sphere: gradients in the tangent planes.
  const double slope = (plane_in_b - value * *ray_b).squaredNorm() +
                       (plane_in_a - ray_a->dot(plane_in_a) * *ray_a).squaredNorm();
  if (!(slope > 0)) return far_px;
  const double px = std::abs(value) / std::sqrt(slope) * b.lens.params.front();
  if (!(px < far_px)) return far_px;
  // Distances along both rays: l_a turned + t = l_b ray_b.
  const double cosine = turned.dot(*ray_b), sine2 = 1 - cosine * cosine;
  if (sine2 < kMinParallaxRad * kMinParallaxRad) return px;
  const double along_a = (cosine * t.dot(*ray_b) - t.dot(turned)) / sine2;
  const double along_b = (t.dot(*ray_b) - cosine * t.dot(turned)) / sine2;
  return along_a > 0 && along_b > 0 ? px : far_px;
}

std::vector<double> ResidualsOf(const std::vector<Match>& matches,
                                std::span<const GivenCamera> cameras) {
  std::vector<double> residuals;
  residuals.reserve(matches.size());
  for (const Match& match : matches) residuals.push_back(ResidualPx(match, cameras));
  return residuals;
}

double Median(std::vector<double> values) { return UpperMedian(values); }

double MeanLoss(const std::vector<double>& residuals, double scale_px) {
  double sum = 0;
  for (const double r : residuals) sum += CauchyLoss(r, scale_px);
  return sum / static_cast<double>(residuals.size());
}

// How surely the mean loss fell, in standard deviations of the mean difference.
double SigmasFallen(const std::vector<double>& before, const std::vector<double>& after,
                    double scale_px) {
  const auto [mean, deviation] = DecreaseOfLoss(before, after, scale_px);
  return deviation > 0 ? mean / deviation : 0;
}

// Radial distortion that the matches ask for, where the cameras have none: searched, as no file
// holds it.
std::optional<CameraHypothesis> FoundDistortion(std::span<const GivenCamera> cameras,
                                                const std::vector<Match>& matches,
                                                double scale_px) {
  for (const GivenCamera& camera : cameras) {
    if (!camera.lens.IsUndistorted()) return {};
  }
  std::vector<Match> some;
  constexpr size_t kSome = 1500;
  for (size_t i = 0; i < matches.size(); i += std::max<size_t>(1, matches.size() / kSome)) {
    some.push_back(matches[i]);
  }
  const auto loss = [&](double k1) {
    return MeanLoss(ResidualsOf(some, WithRadial(cameras, k1)), scale_px);
  };
  constexpr double kMaxK1 = 0.4, kStep = 0.05;
  double best = 0, least = loss(0);
  for (double k1 = -kMaxK1; k1 <= kMaxK1 + 1e-9; k1 += kStep) {
    const double of = loss(k1);
    if (of < least) {
      least = of;
      best = k1;
    }
  }
  for (double step = kStep / 2; step > 1e-4; step /= 2) {
    for (const double k1 : {best - step, best + step}) {
      const double of = loss(k1);
      if (of >= least) continue;
      least = of;
      best = k1;
    }
  }
  if (best == 0) return {};
  return CameraHypothesis{
      "distorted photos",
      fmt::format("the cameras state no distortion, the photos have radial distortion (k1 near "
                  "{:.3f}): give the cameras with their distortion, or undistorted photos",
                  best),
      true, WithRadial(cameras, best)};
}

struct Best {
  CameraHypothesis hypothesis;
  std::vector<double> residuals;
  double loss = 0;
};

}  // namespace

bool ConventionReport::tested() const { return matches >= kMinConventionMatches; }

ConventionReport TestConventions(std::span<const GivenCamera> cameras,
                                 std::span<const MatchedPair> pairs) {
  ConventionReport report;
  const std::vector<Match> matches = Thinned(pairs);
  report.matches = static_cast<int>(matches.size());
  report.pairs = static_cast<int>(pairs.size());
  if (!report.tested()) return report;
  std::vector<GivenCamera> now(cameras.begin(), cameras.end());
  std::vector<double> residuals = ResidualsOf(matches, now);
  report.given_px = Median(residuals);
  report.limit_px = kLimitShare * LongSide(now.front().lens);
  double median = report.given_px;
  for (int i = 0; i < kMaxMistakes && median > kExactPx; ++i) {
    const double scale_px = std::max(kMinScalePx, median);
    std::vector<CameraHypothesis> hypotheses = HypothesesFor(now);
    // A residual of many pixels is no distortion: searching it would find whatever fits a little.
    if (auto found = FoundDistortion(now, matches, scale_px)) {
      hypotheses.push_back(std::move(*found));
    }
    std::optional<Best> best;
    for (CameraHypothesis& hypothesis : hypotheses) {
      std::vector<double> of = ResidualsOf(matches, hypothesis.cameras);
      const double share = Median(of) / median;
      if (!(share < (hypothesis.is_fine ? 0.9 : 0.5))) continue;
      if (SigmasFallen(residuals, of, scale_px) < kMinSigmas) continue;
      const double loss = MeanLoss(of, scale_px);
      if (!best || loss < best->loss) best = Best{std::move(hypothesis), std::move(of), loss};
    }
    if (!best) break;
    residuals = std::move(best->residuals);
    median = Median(residuals);
    report.found.push_back({best->hypothesis.name, best->hypothesis.advice, median});
    now = std::move(best->hypothesis.cameras);
  }
  return report;
}

std::string LineOf(const ConventionReport& report, const std::string& file) {
  if (!report.tested() || report.fits()) return "";
  std::string line = fmt::format(
      "{}: matched features lie {:.3g} px from where its cameras expect them (median of "
      "{} matches of {} pairs)",
      file, report.given_px, report.matches, report.pairs);
  if (report.found.empty()) {
    return line + "; no usual mistake explains it: are these its photos, and its cameras exact?";
  }
  for (const Convention& convention : report.found) {
    line += fmt::format("; {:.2g} px {} {}: {}", convention.residual_px,
                        &convention == &report.found.front() ? "with" : "and also with",
                        convention.name, convention.advice);
  }
  return line;
}

}  // namespace dtr::calib
