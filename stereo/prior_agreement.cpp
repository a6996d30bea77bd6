#include "stereo/prior_agreement.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/order_statistics.h"
#include "stereo/scene_index.h"

namespace dtr::stereo {
namespace {

constexpr double kSigmaPerMedian = 1.4826;
/// Standard deviation of a median of n normal values, times the root of n, over theirs.
constexpr double kMedianSigma = 1.2533;

constexpr double kViewRatio = 0.03, kViewNoise = 0.03, kViewSigmas = 4;
/// An outlier is off by so much, relative, at least.
constexpr double kOutlier = 0.1;

/// The shifts that are tried: 17 x 17, a pixel of a map of 250 apart.
constexpr int kShifts = 8;
constexpr int kSide = 2 * kShifts + 1;
constexpr double kShiftStep = 1.0 / 250;
constexpr double kShiftCut = 0.2;
constexpr double kShiftGain = 0.15, kShiftViews = 0.75;
/// Points of a view that shifts are tried with.
constexpr size_t kShiftPoints = 600;
/// A view says something of the shift from so many points on.
constexpr size_t kMinShiftPoints = 24;

constexpr size_t kBins = 5, kMinBinPoints = 30;
/// No depth map is better than this, and none is taken to be.
constexpr double kMinNoise = 1e-3;

struct Point {
  Eigen::Vector2d share;  ///< of the image's width and height
  double z = 0;
};

struct Sample {
  double z = 0, log_ratio = 0;
};

using ShiftCosts = std::array<double, kSide * kSide>;

double MedianOf(std::vector<double> values) { return UpperMedian(values); }

double SigmaAbout(const std::vector<double>& values, double centre) {
  std::vector<double> off;
  for (const double value : values) off.push_back(std::abs(value - centre));
  return kSigmaPerMedian * UpperMedian(off);
}

std::vector<Point> PointsSeen(const StereoView& view, const SparseScene& scene,
                              const std::vector<int>& points) {
  std::vector<Point> seen;
  for (const int p : points) {
    const Eigen::Vector3d in_cam =
        view.cam_from_world * scene.points[static_cast<size_t>(p)].p_in_world;
    const auto pixel = view.camera.PixelFromCam(in_cam);
    if (!pixel || !view.camera.Contains(*pixel)) continue;
    seen.push_back(
        {{pixel->x() / view.camera.width_px(), pixel->y() / view.camera.height_px()}, in_cam.z()});
  }
  return seen;
}

std::vector<Sample> SamplesOf(const PriorPlanes& planes, const std::vector<Point>& points) {
  std::vector<Sample> samples;
  for (const Point& point : points) {
    const auto plane = planes.At(point.share);
    if (!plane || plane->at_edge) continue;
    samples.push_back({point.z, -std::log(plane->inverse_depth * point.z)});
  }
  return samples;
}

/// Mean deviation, cut off, of the log ratios from their median under one shift. What has no depth
/// there counts as cut off: else a shift into a hole would fit best.
double CostOf(const PriorPlanes& planes, const std::vector<Point>& points,
              const Eigen::Vector2d& shift) {
  std::vector<double> logs;
  for (const Point& point : points) {
    const auto plane = planes.At(point.share - shift);
    if (plane) logs.push_back(-std::log(plane->inverse_depth * point.z));
  }
  if (2 * logs.size() < points.size()) return kShiftCut;
  const double median = MedianOf(logs);
  double sum = kShiftCut * static_cast<double>(points.size() - logs.size());
  for (const double log_ratio : logs) sum += std::min(std::abs(log_ratio - median), kShiftCut);
  return sum / static_cast<double>(points.size());
}

ShiftCosts TryShifts(const PriorPlanes& planes, const std::vector<Point>& all, double aspect) {
  std::vector<Point> points;
  const size_t every = all.size() / kShiftPoints + 1;
  for (size_t i = 0; i < all.size(); i += every) points.push_back(all[i]);
  ShiftCosts costs{};
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const Eigen::Vector2d shift(kShiftStep * (i - kShifts), aspect * kShiftStep * (j - kShifts));
      costs[static_cast<size_t>(kSide * j + i)] = CostOf(planes, points, shift);
    }
  }
  return costs;
}

/// The least of three costs by a parabola, in steps from the middle one.
double Vertex(double before, double here, double after) {
  const double bend = before - 2 * here + after;
  return bend > 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

Eigen::Vector2d BestShift(const std::vector<ShiftCosts>& views) {
  if (views.empty()) return Eigen::Vector2d::Zero();
  ShiftCosts sum{};
  for (const ShiftCosts& view : views) {
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += view[i];
  }
  constexpr size_t kNone = kSide * kShifts + kShifts;
  const auto best = static_cast<size_t>(std::min_element(sum.begin(), sum.end()) - sum.begin());
  if (best == kNone || !(sum[best] < (1 - kShiftGain) * sum[kNone])) return {0, 0};
  const auto better = std::count_if(
      views.begin(), views.end(), [&](const ShiftCosts& view) { return view[best] < view[kNone]; });
  if (static_cast<double>(better) < kShiftViews * static_cast<double>(views.size())) return {0, 0};
  const size_t i = best % kSide, j = best / kSide;
  Eigen::Vector2d at(static_cast<double>(i) - kShifts, static_cast<double>(j) - kShifts);
  if (i > 0 && i + 1 < kSide) at.x() += Vertex(sum[best - 1], sum[best], sum[best + 1]);
  if (j > 0 && j + 1 < kSide) at.y() += Vertex(sum[best - kSide], sum[best], sum[best + kSide]);
  return kShiftStep * at;
}

ViewPrior Measured(int view, const std::vector<Sample>& samples) {
  ViewPrior result;
  result.view = view;
  result.points = static_cast<int>(samples.size());
  if (result.points < kMinPriorPoints) {
    result.fit = ViewPrior::Fit::kFewPoints;
    return result;
  }
  std::vector<double> logs;
  for (const Sample& sample : samples) logs.push_back(sample.log_ratio);
  const double median = MedianOf(logs);
  result.ratio = std::exp(median);
  result.noise = SigmaAbout(logs, median);
  const double limit = std::max(kOutlier, kViewSigmas * result.noise);
  const auto outliers = std::count_if(logs.begin(), logs.end(), [&](double log_ratio) {
    return std::abs(log_ratio - median) > limit;
  });
  result.outliers = static_cast<double>(outliers) / static_cast<double>(logs.size());
  return result;
}

/// Compares the views with one another, and sets what is said of all.
void Compare(PriorAgreement& all) {
  std::vector<double> medians, noises, outliers;
  for (const ViewPrior& view : all.views) {
    if (view.fit == ViewPrior::Fit::kFewPoints) continue;
    medians.push_back(std::log(view.ratio));
    noises.push_back(view.noise);
    outliers.push_back(view.outliers);
  }
  if (medians.empty()) return;
  const double median = MedianOf(medians), noise = MedianOf(noises);
  const double usual_outliers = MedianOf(outliers);
  for (ViewPrior& view : all.views) {
    if (view.fit == ViewPrior::Fit::kFewPoints) continue;
    const double off = std::abs(std::log(view.ratio) - median);
    if (off > std::max(kViewRatio, kViewSigmas * noise) ||
        view.noise > std::max(kViewNoise, kViewSigmas * noise) ||
        view.outliers > std::max(kMaxPriorOutliers, 2 * usual_outliers)) {
      view.fit = ViewPrior::Fit::kDiffers;
    }
  }
  std::vector<double> fitting, fitting_noise, fitting_outliers;
  for (const ViewPrior& view : all.views) {
    if (view.fit != ViewPrior::Fit::kFits) continue;
    fitting.push_back(std::log(view.ratio));
    fitting_noise.push_back(view.noise);
    fitting_outliers.push_back(view.outliers);
    all.points += view.points;
  }
  if (fitting.empty()) return;
  const double log_scale = MedianOf(fitting);
  all.scale = std::exp(log_scale);
  all.noise = MedianOf(fitting_noise);
  all.outliers = MedianOf(fitting_outliers);
  all.scale_sigma = kMedianSigma * std::hypot(all.noise / std::sqrt(all.points),
                                              SigmaAbout(fitting, log_scale) /
                                                  std::sqrt(static_cast<double>(fitting.size())));
}

void Distances(std::vector<Sample> samples, PriorAgreement& all) {
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
    return a.z != b.z ? a.z < b.z : a.log_ratio < b.log_ratio;
  });
  const size_t bins = std::clamp<size_t>(samples.size() / kMinBinPoints, 1, kBins);
  for (size_t n = 0; n < bins; ++n) {
    const size_t begin = samples.size() * n / bins, end = samples.size() * (n + 1) / bins;
    if (begin == end) continue;
    std::vector<double> off;
    for (size_t i = begin; i < end; ++i) {
      off.push_back(samples[i].log_ratio - std::log(all.scale));
    }
    const double bias = MedianOf(off), noise = SigmaAbout(off, bias);
    all.by_distance.push_back(
        {samples[begin].z, samples[end - 1].z, static_cast<int>(end - begin), bias, noise});
    const double middle = samples[(begin + end) / 2].z;
    if (!all.expected.z.empty() && !(middle > all.expected.z.back())) continue;
    all.expected.z.push_back(middle);
    all.expected.sigma.push_back(std::max(kMinNoise, std::hypot(bias, noise)));
  }
}

}  // namespace

int PriorAgreement::Count(ViewPrior::Fit fit) const {
  return static_cast<int>(
      std::count_if(views.begin(), views.end(), [&](const ViewPrior& v) { return v.fit == fit; }));
}

PriorAgreement MeasurePriors(std::span<const StereoView> views, const SparseScene& scene,
                             const std::function<std::optional<DepthImage>(int view)>& load) {
  const std::vector<std::vector<int>> points_of = PointsOfViews(scene, views.size());
  PriorAgreement all;
  std::vector<std::vector<Sample>> samples_of;
  std::vector<ShiftCosts> shifts;
  for (size_t v = 0; v < views.size(); ++v) {
    const auto depth = load(static_cast<int>(v));
    if (!depth) continue;
    const PriorPlanes planes(*depth);
    const std::vector<Point> points = PointsSeen(views[v], scene, points_of[v]);
    samples_of.push_back(SamplesOf(planes, points));
    all.views.push_back(Measured(static_cast<int>(v), samples_of.back()));
    if (samples_of.back().size() < kMinShiftPoints) continue;
    const double aspect =
        static_cast<double>(views[v].camera.width_px()) / views[v].camera.height_px();
    shifts.push_back(TryShifts(planes, points, aspect));
  }
  Compare(all);
  all.shift = BestShift(shifts);
  std::vector<Sample> samples;
  for (size_t i = 0; i < all.views.size(); ++i) {
    if (all.views[i].fit != ViewPrior::Fit::kFits) continue;
    samples.insert(samples.end(), samples_of[i].begin(), samples_of[i].end());
  }
  Distances(std::move(samples), all);
  return all;
}

}  // namespace dtr::stereo
