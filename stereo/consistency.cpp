#include "stereo/consistency.h"

#include <cmath>
#include <optional>

#include "dtr/base/parallel_for.h"
#include "stereo/prior_use.h"

namespace dtr::stereo {
namespace {

/// Four depths farther apart than this (largest over smallest) are not one surface.
constexpr float kSmoothRatio = 1.03f;

/// Exponent by which sigma grows with the share of the maps that refute a kept pixel: their log
/// odds in a logistic regression of depths that are wrong by more than 2 pixels on plaza
/// (docs/accuracy/DEPTH.md).
constexpr double kDoubtPerRefuting = 5;

/// Inverse depth of a map at a pixel position: bilinear on one surface, else the nearest pixel's.
std::optional<double> InverseDepthAt(const DepthImage& depth, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (depth.Contains(x0, y0) && depth.Contains(x0 + 1, y0 + 1)) {
    const float a = depth(x0, y0), b = depth(x0 + 1, y0);
    const float c = depth(x0, y0 + 1), d = depth(x0 + 1, y0 + 1);
    const float low = std::min(std::min(a, b), std::min(c, d));
    const float high = std::max(std::max(a, b), std::max(c, d));
    if (low > 0 && high <= kSmoothRatio * low) {
      const double u = x - x0, v = y - y0;
      return (1 - v) * ((1 - u) / a + u / b) + v * ((1 - u) / c + u / d);
    }
  }
  const int xn = static_cast<int>(std::floor(pixel.x())),
            yn = static_cast<int>(std::floor(pixel.y()));
  if (!depth.Contains(xn, yn) || DepthImage::IsHole(depth(xn, yn))) return std::nullopt;
  return 1.0 / depth(xn, yn);
}

float Doubt(int confirming, int refuting) {
  return static_cast<float>(std::exp(kDoubtPerRefuting * refuting / (confirming + refuting + 1)));
}

/// What is needed of another view, worked out once per map.
struct Checker {
  const OtherDepth* other;
  Pose other_from_view;
  double px_per_inverse_depth;

  /// +1: confirms, -1: refutes, 0: says nothing.
  int Vote(const Eigen::Vector3d& p_in_view, double tolerance_px) const {
    const Eigen::Vector3d p = other_from_view * p_in_view;
    const auto pixel = other->view->camera.PixelFromCam(p);
    if (!pixel) return 0;
    const auto inverse_depth = InverseDepthAt(other->estimate->depth, *pixel);
    if (!inverse_depth) return 0;
    const double nearer_px = px_per_inverse_depth * (*inverse_depth - 1.0 / p.z());
    if (std::abs(nearer_px) <= tolerance_px) return 1;
    return nearer_px < 0 ? -1 : 0;
  }
};

/// The view's prior, which has seen the surface too.
class Instrument {
 public:
  explicit Instrument(const DepthPrior& prior) : noise_(prior.noise), planes_(prior.load()) {}

  bool Confirms(const Eigen::Vector2d& share, double z) const {
    const auto plane = planes_.At(share);
    if (!plane || plane->at_edge) return false;
    return std::abs(z * plane->inverse_depth - 1) <= kPriorSigmas * noise_.At(z);
  }

 private:
  RelativeNoise noise_;
  PriorPlanes planes_;
};

}  // namespace

DepthEstimate FilterByConsistency(const StereoView& view, const DepthEstimate& estimate,
                                  std::span<const OtherDepth> others,
                                  const ConsistencyOptions& options, const Mask* wanted) {
  if (options.min_agreeing <= 0) return estimate;
  std::vector<Checker> checkers;
  for (const OtherDepth& other : others) {
    const double baseline = (other.view->cam_from_world.TargetOriginInSource() -
                             view.cam_from_world.TargetOriginInSource())
                                .norm();
    checkers.push_back({&other, other.view->cam_from_world * view.cam_from_world.Inverse(),
                        other.view->camera.fx_px() * baseline});
  }
  const std::optional<Instrument> instrument =
      view.prior != nullptr ? std::optional<Instrument>(*view.prior) : std::nullopt;
  DepthEstimate result = estimate;
  ParallelFor(0, estimate.depth.height(), [&](int y) {
    for (int x = 0; x < estimate.depth.width(); ++x) {
      const float z = estimate.depth(x, y);
      if (DepthImage::IsHole(z)) continue;
      if (wanted != nullptr && (*wanted)(x, y) == 0) continue;
      const Eigen::Vector3d p = view.camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      const Eigen::Vector2d share((x + 0.5) / estimate.depth.width(),
                                  (y + 0.5) / estimate.depth.height());
      int confirming = instrument && instrument->Confirms(share, z) ? 1 : 0, refuting = 0;
      for (const Checker& checker : checkers) {
        const int vote = checker.Vote(p, options.tolerance_px);
        confirming += vote > 0;
        refuting += vote < 0;
      }
      if (confirming >= options.min_agreeing && confirming >= refuting) {
        if (refuting > 0) result.inverse_depth_sigma(x, y) *= Doubt(confirming, refuting);
        continue;
      }
      result.depth(x, y) = 0;
      result.inverse_depth_sigma(x, y) = 0;
    }
  });
  return result;
}

}  // namespace dtr::stereo
