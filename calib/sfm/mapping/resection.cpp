#include "calib/sfm/mapping/resection.h"

#include <algorithm>
#include <map>
#include <set>

#include "calib/sfm/registration/absolute_pose.h"

namespace dtr::sfm {
namespace {

constexpr int kMinPoints = 6;

using FeatureKey = std::pair<int, std::uint32_t>;

}  // namespace

std::vector<FeaturePoint> PointsSeenBy(const ViewGraph& graph, int image,
                                       std::span<const MapPoint> points) {
  std::map<FeatureKey, int> point_of;
  for (size_t p = 0; p < points.size(); ++p) {
    for (const TrackFeature& f : points[p].seen)
      point_of[{f.image, f.feature}] = static_cast<int>(p);
  }
  // How many matches say that a feature shows a point; the most of them count.
  std::map<std::uint32_t, std::map<int, int>> votes;
  for (const PairGeometry& pair : graph.pairs) {
    if (pair.image_a != image && pair.image_b != image) continue;
    const bool is_a = pair.image_a == image;
    for (const auto& [a, b] : pair.matches) {
      const auto at = point_of.find({is_a ? pair.image_b : pair.image_a, is_a ? b : a});
      if (at != point_of.end()) ++votes[is_a ? a : b][at->second];
    }
  }
  std::vector<FeaturePoint> seen;
  std::set<int> taken;
  for (const auto& [feature, of] : votes) {
    int best = -1, most = 0;
    for (const auto& [point, count] : of) {
      if (count > most) best = point, most = count;
    }
    if (taken.insert(best).second) seen.push_back({feature, best});
  }
  return seen;
}

std::optional<Pose> Resect(const ViewGraph& graph, const MapCameras& cameras, int image,
                           std::span<const MapPoint> points, double limit_px, int min_agree,
                           std::vector<FeaturePoint>* seen) {
  PointRays known;
  std::vector<FeaturePoint> used;
  for (const FeaturePoint& s : *seen) {
    const Eigen::Vector3d& ray = cameras.rays[image][s.feature];
    if (!(ray.z() > 0.1)) continue;
    known.Add(points[s.point].p_in_world, ray.hnormalized());
    used.push_back(s);
  }
  seen->clear();
  const calib::LensCamera& lens = cameras.lenses[graph.images[image].camera];
  const auto found = FindPose(known, limit_px / lens.params[0], std::max(min_agree, kMinPoints));
  if (!found) return std::nullopt;
  PointRays agreeing;
  for (const int i : found->inliers) {
    agreeing.Add(known.points[i], known.rays[i]);
    seen->push_back(used[i]);
  }
  return RefineAbsolutePose(agreeing, found->cam_from_world);
}

}  // namespace dtr::sfm
