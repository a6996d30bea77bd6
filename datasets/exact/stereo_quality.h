// datasets/exact/stereo_quality.h -- what the tests of the depth engines share: images of a
// surface from some places, an estimate for the first of them, and how good it is.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "datasets/exact/stereo_scene.h"
#include "dtr/base/order_statistics.h"

namespace dtr::stereo::testing {

inline Surface Slanted() {
  const Eigen::Vector3d normal(0.25, -0.35, 1);
  return Plane(normal.normalized(), 4 / normal.norm());
}

inline Surface SphereBeforeWall() { return Union({Sphere({0, 0, 4}, 0.9), Plane({0, 0, 1}, 6)}); }

inline std::vector<Shot> ShotsOf(const Surface& surface, const PinholeCamera& camera,
                                 const std::vector<Pose>& poses) {
  std::vector<Shot> shots;
  for (const Pose& pose : poses) shots.push_back(Photograph(surface, camera, pose, 0.35));
  return shots;
}

inline std::vector<StereoView> ViewsOf(const std::vector<Shot>& shots) {
  std::vector<StereoView> views;
  for (const Shot& shot : shots) views.push_back(shot.View());
  return views;
}

/// Depth of the first view, all others being its neighbours.
inline DepthEstimate EstimateFirstBy(const std::string& engine,
                                     const std::vector<StereoView>& views,
                                     const DepthRange& range) {
  std::vector<int> neighbours;
  for (int i = 1; i < static_cast<int>(views.size()); ++i) neighbours.push_back(i);
  return MakeEngine(engine)->Estimate(views, 0, neighbours, range, {});
}

struct Quality {
  double kept = 0, median_px = 0, mean_px = 0, bad_share = 0;
};

/// Errors in px of disparity, `px` of them to a unit of inverse depth (focal length x baseline);
/// `mean_px` is signed, without outliers over 2 px, and 0 where nothing is left.
inline Quality QualityAt(double px, const DepthEstimate& estimate, const DepthImage& truth) {
  std::vector<double> errors;
  double sum = 0;
  int near = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (DepthImage::IsHole(estimate.depth(x, y))) continue;
      const double off = px * (1.0 / estimate.depth(x, y) - 1.0 / truth(x, y));
      errors.push_back(std::abs(off));
      if (std::abs(off) <= 2) sum += off, ++near;
    }
  }
  Quality q;
  if (errors.empty()) return q;
  q.kept = static_cast<double>(errors.size()) / (truth.width() * truth.height());
  q.bad_share = static_cast<double>(
                    std::count_if(errors.begin(), errors.end(), [](double e) { return e > 1; })) /
                static_cast<double>(errors.size());
  q.median_px = UpperMedian(errors);
  q.mean_px = near > 0 ? sum / near : 0;
  return q;
}

}  // namespace dtr::stereo::testing
