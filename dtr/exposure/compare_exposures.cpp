#include "dtr/exposure/compare_exposures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dtr/render/exposure.h"
#include "dtr/render/texture.h"

namespace dtr {
namespace {

using Eigen::Array3d;
using Eigen::Vector3d;

constexpr float kSameSurfacePx = 0.5;                   ///< of disparity, in little
constexpr int kPatchPx = 8;                             ///< side of a patch, in little
constexpr size_t kMinPixels = kPatchPx * kPatchPx / 2;  ///< that both views measured of a patch
constexpr size_t kMinPatches = 5;                       ///< in common, for two views to be compared
constexpr double kFullPatches = 25;    ///< from which on more of them count no more
constexpr int kExposureSteps = 30;     ///< of Newton's method; 3 or 4 are enough as a rule
constexpr double kMaxLogExposure = 4;  ///< beyond which two photos show nothing in common

// A patch's log exposure has the variance that its pixels leave, and that of: shading and depth;
// the camera's black, by half an 8-bit value, in linear light; what is lost of it as it is black,
// white or masked in a view, half as bright again as the rest. (And the camera's curve: ours and a
// plain proportion up to white are up to v^4 / 4 apart.)
constexpr double kPatchSigma = 0.005, kBlackSigma = 1.5e-4, kLostSigma = 0.5;

/// A quarter of the patches is where most of them agree. A normal law in three dimensions has this
/// share of its values within so many standard deviations.
constexpr double kDenseShare = 0.25, kSigmasOfDense = 1.101;
constexpr double kReachSigmas = 4.685;  ///< of Tukey's biweight (95 % efficient on a normal law)
constexpr int kScaleSteps = 3, kLocationSteps = 30;
constexpr double kSettled = 1e-6;

struct Patch {
  Vector3d log_exposure;
  double weight;
};

/// The same pixels of a patch of surface in two views.
class PatchPixels {
 public:
  void Clear() { from_.clear(), to_.clear(), unusable_ = 0; }
  void Add(const Array3d& from, const Array3d& to) {
    if (from[0] > 0 && to[0] > 0) {
      from_.push_back(from), to_.push_back(to);
    } else {
      ++unusable_;
    }
  }
  std::optional<Patch> Compare() const {
    if (from_.size() < kMinPixels) return std::nullopt;
    Patch patch{Vector3d::Zero(), 0};
    double variance = 0;
    for (int c = 0; c < 3; ++c) {
      patch.log_exposure[c] = LogExposure(c);
      variance += Variance(c, std::exp(patch.log_exposure[c]));
    }
    patch.weight = 1 / variance;
    return patch;
  }

 private:
  // By Newton's method within bounds: the exposure that makes the light of one patch that of the
  // other.
  double LogExposure(int c) const {
    double from_sum = 0, to_sum = 0;
    for (size_t i = 0; i < from_.size(); ++i) from_sum += from_[i][c], to_sum += to_[i][c];
    const auto count = static_cast<double>(from_.size());
    double log_exposure = std::log(ExposureBetween(from_sum / count, to_sum / count));
    double low = -kMaxLogExposure, high = kMaxLogExposure;
    if (!(low < log_exposure && log_exposure < high)) log_exposure = 0;
    for (int step = 0; step < kExposureSteps; ++step) {
      double sum = 0, slope = 0;
      for (const Array3d& from : from_) {
        const double light = Exposed(from[c], std::exp(log_exposure));
        sum += light;
        slope += light * (1 - light * light * light * light);
      }
      (sum < to_sum ? low : high) = log_exposure;
      double next = log_exposure + (to_sum - sum) / slope;
      if (!(low < next && next < high)) next = 0.5 * (low + high);  // the curve is flat there
      const bool settled = std::abs(next - log_exposure) < kSettled;
      log_exposure = next;
      if (settled) break;
    }
    return log_exposure;
  }

  double Variance(int c, double exposure) const {
    double left = 0, sum = 0, darker = 0, bent = 0;
    for (size_t i = 0; i < from_.size(); ++i) {
      const double from = from_[i][c], to = to_[i][c], off = to - Exposed(from, exposure);
      left += off * off;
      sum += to;
      darker += std::min(from, to);
      bent += std::pow(std::max(from, to), 5);
    }
    const auto count = static_cast<double>(from_.size());
    const double curve = bent / (4 * sum), black = kBlackSigma * count / darker;
    const double lost = kLostSigma * unusable_ / (count + unusable_);
    return left / (sum * sum) + curve * curve + black * black + lost * lost +
           kPatchSigma * kPatchSigma;
  }

  std::vector<Array3d> from_, to_;
  int unusable_ = 0;
};

Array3d LightAt(const SmallView& view, int x, int y) {
  return {view.light(x, y, 0), view.light(x, y, 1), view.light(x, y, 2)};
}

/// Bilinear between the centres of pixels; 0 where one of the four is unusable.
Array3d LightAt(const SmallView& view, const Eigen::Vector2d& pixel) {
  const BilinearTaps taps(view.light.width(), view.light.height(), pixel);
  Array3d sum = Array3d::Zero();
  for (size_t tap = 0; tap < 4; ++tap) {
    const Array3d light = LightAt(view, taps.columns[tap], taps.rows[tap]);
    if (!(light[0] > 0)) return Array3d::Zero();
    sum += taps.weights[tap] * light;
  }
  return sum;
}

/// Finds where view `to` shows what a pixel of view `from` does.
class Correspondences {
 public:
  Correspondences(const SmallView& from, const SmallView& to)
      : from_(from),
        to_(to),
        to_from_from_(to.cam_from_world * from.cam_from_world.Inverse()),
        px_per_inverse_depth_(
            static_cast<float>(to.camera.fx_px() * to_from_from_.translation.norm())) {}

  std::optional<Eigen::Vector2d> Of(int x, int y) const {
    const float w = from_.inverse_depth(x, y);
    if (!(w > 0)) return std::nullopt;
    const Vector3d point =
        to_from_from_ * (from_.camera.RayFromPixel({x + 0.5, y + 0.5}) / static_cast<double>(w));
    const auto pixel = to_.camera.PixelFromCam(point);
    if (!pixel || !to_.camera.Contains(*pixel)) return std::nullopt;
    const float seen =
        to_.inverse_depth(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
    if (!(seen > 0)) return std::nullopt;
    const float off = (seen - static_cast<float>(1 / point.z())) * px_per_inverse_depth_;
    if (std::abs(off) > kSameSurfacePx) return std::nullopt;
    return pixel;
  }

 private:
  const SmallView &from_, &to_;
  const Pose to_from_from_;
  const float px_per_inverse_depth_;
};

std::vector<Patch> CommonPatches(const SmallView& from, const SmallView& to) {
  const Correspondences correspondences(from, to);
  const int width = from.light.width(), height = from.light.height();
  std::vector<Patch> patches;
  PatchPixels pixels;
  for (int top = 0; top < height; top += kPatchPx) {
    for (int left = 0; left < width; left += kPatchPx) {
      pixels.Clear();
      for (int y = top; y < std::min(top + kPatchPx, height); ++y) {
        for (int x = left; x < std::min(left + kPatchPx, width); ++x) {
          const auto at = correspondences.Of(x, y);
          if (at) pixels.Add(LightAt(from, x, y), LightAt(to, *at));
        }
      }
      if (const auto patch = pixels.Compare()) patches.push_back(*patch);
    }
  }
  return patches;
}

struct Weighted {
  double value, weight;
};

double TotalOf(const std::vector<Weighted>& values) {
  double total = 0;
  for (const Weighted& value : values) total += value.weight;
  return total;
}

void Sort(std::vector<Weighted>& values) {
  std::sort(values.begin(), values.end(), [](const Weighted& a, const Weighted& b) {
    return a.value != b.value ? a.value < b.value : a.weight < b.weight;
  });
}

/// The middle of the shortest interval with kDenseShare of the weight.
double MiddleOfDensest(std::vector<Weighted> values) {
  Sort(values);
  const double wanted = kDenseShare * TotalOf(values);
  double middle = 0, shortest = std::numeric_limits<double>::infinity(), inside = 0;
  for (size_t first = 0, end = 0; first < values.size(); inside -= values[first++].weight) {
    while (end < values.size() && inside < wanted) inside += values[end++].weight;
    if (inside < wanted) break;
    const double length = values[end - 1].value - values[first].value;
    if (length >= shortest) continue;
    shortest = length;
    middle = values[first].value + 0.5 * length;
  }
  return middle;
}

/// The distance from `middle` within which kDenseShare of the weight lies.
double DenseRadius(const std::vector<Patch>& patches, const Vector3d& middle) {
  std::vector<Weighted> distances;
  for (const Patch& patch : patches) {
    distances.push_back({(patch.log_exposure - middle).norm(), patch.weight});
  }
  Sort(distances);
  const double wanted = kDenseShare * TotalOf(distances);
  double inside = 0;
  for (const Weighted& distance : distances) {
    inside += distance.weight;
    if (inside >= wanted) return distance.value;
  }
  return distances.back().value;
}

Vector3d Biweight(const std::vector<Patch>& patches, Vector3d middle, double reach) {
  for (int step = 0; step < kLocationSteps; ++step) {
    Vector3d sum = Vector3d::Zero();
    double weights = 0;
    for (const Patch& patch : patches) {
      const double u2 = (patch.log_exposure - middle).squaredNorm() / (reach * reach);
      if (u2 >= 1) continue;
      const double weight = patch.weight * (1 - u2) * (1 - u2);
      sum += weight * patch.log_exposure;
      weights += weight;
    }
    if (!(weights > 0)) break;
    const Vector3d next = sum / weights;
    const bool settled = (next - middle).norm() < kSettled;
    middle = next;
    if (settled) break;
  }
  return middle;
}

/// Where most of the patches lie. Highlights, and colours of other surfaces where depth is wrong,
/// lie to one side and move a median by what they are; this hardly, as long as the right ones lie
/// closest together. A patch that is off in one channel counts in none.
Vector3d DensestLogExposure(const std::vector<Patch>& patches) {
  Vector3d middle;
  for (int c = 0; c < 3; ++c) {
    std::vector<Weighted> values;
    for (const Patch& patch : patches) values.push_back({patch.log_exposure[c], patch.weight});
    middle[c] = MiddleOfDensest(std::move(values));
  }
  for (int step = 0; step < kScaleSteps; ++step) {
    const double sigma = std::max(DenseRadius(patches, middle) / kSigmasOfDense, kSettled);
    middle = Biweight(patches, middle, kReachSigmas * sigma);
  }
  return middle;
}

}  // namespace

std::optional<ExposurePair> CompareExposures(std::span<const SmallView> views, int a, int b) {
  const std::vector<Patch> patches =
      CommonPatches(views[static_cast<size_t>(a)], views[static_cast<size_t>(b)]);
  if (patches.size() < kMinPatches) return std::nullopt;
  const double weight = std::min(1.0, static_cast<double>(patches.size()) / kFullPatches);
  return ExposurePair{a, b, weight, DensestLogExposure(patches)};
}

}  // namespace dtr
