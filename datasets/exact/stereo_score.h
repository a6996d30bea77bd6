// datasets/exact/stereo_score.h -- what a depth engine can at best know about a scene, and how an
// estimate compares with that.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <vector>

#include "datasets/exact/stereo_quality.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/progress.h"
#include "stereo/consistency.h"
#include "stereo/geometric_passes.h"

namespace dtr::stereo::testing {

/// A camera at `centre` that looks at `target`, x level.
inline Pose LookingAt(const Vector3d& centre, const Vector3d& target) {
  const Vector3d z = (target - centre).normalized();
  const Vector3d x = Vector3d(0, 1, 0).cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(rotation);
  return {q, -(q * centre)};
}

/// Pixels by which the image of a point at depth `z` behind `pixel` of `view` moves in `other`
/// per unit of inverse depth: focal length times baseline where nothing is turned. 0 where it is
/// not in the image.
inline double PxPerInverseDepth(const StereoView& view, const StereoView& other,
                                const Eigen::Vector2d& pixel, double z) {
  const Pose other_from_view = other.cam_from_world * view.cam_from_world.Inverse();
  const double step = 1e-5 / z;
  const auto seen = [&](double w) {
    return other.camera.PixelFromCam(other_from_view *
                                     view.camera.CamFromPixel(pixel, 1 / w, DepthKind::kPlaneZ));
  };
  const auto a = seen(1 / z - step), b = seen(1 / z + step);
  const bool seen_there = a && b && other.camera.Contains(*a) && other.camera.Contains(*b);
  return seen_there ? (*b - *a).norm() / (2 * step) : 0.0;
}

/// Cramer-Rao bound of matching two windows of 7x7 pixels whose grey values carry independent noise
/// of standard deviation `noise` each: sigma^2 = 2 noise^2 / sum of squared slopes along `along`
/// (a unit vector); the median over the image, in pixels. No method does better; one that gives
/// a window's border less weight does worse by about 2.
inline double MatchingLimitPx(const ImageRgb8& image, const Eigen::Vector2d& along, double noise) {
  std::vector<double> limits;
  const int margin = std::min({4, image.width() / 2 - 1, image.height() / 2 - 1});
  const int radius = margin - 1;
  for (int y = margin; y + margin < image.height(); ++y) {
    for (int x = margin; x + margin < image.width(); ++x) {
      double squares = 0;
      for (int j = -radius; j <= radius; ++j) {
        for (int i = -radius; i <= radius; ++i) {
          const Eigen::Vector2d slope(image(x + i + 1, y + j, 1) - image(x + i - 1, y + j, 1),
                                      image(x + i, y + j + 1, 1) - image(x + i, y + j - 1, 1));
          squares += std::pow(0.5 * slope.dot(along), 2);
        }
      }
      limits.push_back(noise * std::sqrt(2 / std::max(squares, 1e-9)));
    }
  }
  return UpperMedian(limits);
}

/// An estimate against truth, on the pixels that `counts` names.
struct Score {
  double kept = 0;       ///< share of the pixels with a depth
  double median_px = 0;  ///< of the kept ones' errors, pixels of disparity in the best view
  double past_1px = 0;   ///< share of the kept
  double within_sigma = 0, within_3_sigma = 0;  ///< shares of the kept
  double median_sigma_px = 0;
};

template <typename Counts>
Score ScoreFirst(const std::vector<StereoView>& views, const DepthEstimate& estimate,
                 const DepthImage& truth, Counts counts) {
  std::vector<double> errors, sigmas;
  int all = 0, past = 0, one = 0, three = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (DepthImage::IsHole(truth(x, y)) || !counts(x, y)) continue;
      double px = 0;
      for (size_t v = 1; v < views.size(); ++v) {
        px = std::max(px, PxPerInverseDepth(views[0], views[v], {x + 0.5, y + 0.5}, truth(x, y)));
      }
      if (px == 0) continue;
      ++all;
      if (DepthImage::IsHole(estimate.depth(x, y))) continue;
      const double error = std::abs(1.0 / estimate.depth(x, y) - 1.0 / truth(x, y));
      const double sigma = estimate.inverse_depth_sigma(x, y);
      errors.push_back(px * error);
      sigmas.push_back(px * sigma);
      past += px * error > 1;
      one += error <= sigma;
      three += error <= 3 * sigma;
    }
  }
  Score score;
  if (errors.empty()) return score;
  const auto kept = static_cast<double>(errors.size());
  score = {kept / all, UpperMedian(errors), past / kept,
           one / kept, three / kept,        UpperMedian(sigmas)};
  return score;
}

inline Score ScoreFirst(const std::vector<StereoView>& views, const DepthEstimate& estimate,
                        const DepthImage& truth) {
  return ScoreFirst(views, estimate, truth, [](int, int) { return true; });
}

/// The first view's depth as a user gets it: search, passes and both checks, with all other views
/// as everyone's neighbours.
inline DepthEstimate WholeRun(const std::vector<StereoView>& views, const DepthRange& range) {
  const auto engine = MakeEngine("patchmatch");
  const std::vector<DepthRange> ranges(views.size(), range);
  std::vector<ViewNeighbours> neighbours(views.size());
  std::vector<int> all(views.size());
  std::iota(all.begin(), all.end(), 0);
  for (size_t v = 0; v < views.size(); ++v) {
    std::copy_if(all.begin(), all.end(), std::back_inserter(neighbours[v].views),
                 [v](int other) { return other != static_cast<int>(v); });
  }
  const Collection collection{views, neighbours, ranges, engine.get(), {}};
  PlaneMapsInMemory planes;
  SilentProgress progress;
  RunAllPasses(collection, all, planes, progress);
  std::vector<DepthEstimate> judged;
  for (const int v : all) {
    const PlanesAround around(collection, planes, engine->Passes(), v);
    if (!around.HasOwn()) {
      const PinholeCamera& camera = views[static_cast<size_t>(v)].camera;
      judged.push_back({DepthImage(camera.width_px(), camera.height_px()),
                        Grid<float>(camera.width_px(), camera.height_px())});
      continue;
    }
    judged.push_back(engine->Filter(views, v, neighbours[static_cast<size_t>(v)].views, range,
                                    around.maps(), collection.options));
  }
  std::vector<OtherDepth> others;
  for (size_t v = 1; v < views.size(); ++v) others.push_back({&views[v], &judged[v]});
  return FilterByConsistency(views[0], judged[0], others, {});
}

}  // namespace dtr::stereo::testing
