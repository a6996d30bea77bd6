#include "calib/sfm/mapping/resection.h"

#include <map>
#include <opencv2/calib3d.hpp>
#include <set>

#include "calib/sfm/mapping/so3.h"

namespace dtr::sfm {
namespace {

constexpr int kRansacIterations = 2000;
constexpr double kConfidence = 0.9999;

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
  std::vector<cv::Point3d> objects;
  std::vector<cv::Point2d> places;  // on the plane z = 1
  std::vector<FeaturePoint> used;
  for (const FeaturePoint& s : *seen) {
    const Eigen::Vector3d& ray = cameras.rays[image][s.feature];
    if (!(ray.z() > 0.1)) continue;
    const Eigen::Vector3d& p = points[s.point].p_in_world;
    objects.emplace_back(p.x(), p.y(), p.z());
    places.emplace_back(ray.x() / ray.z(), ray.y() / ray.z());
    used.push_back(s);
  }
  seen->clear();
  if (static_cast<int>(used.size()) < std::max(min_agree, 6)) return std::nullopt;
  const calib::LensCamera& lens = cameras.lenses[graph.images[image].camera];
  const auto limit = static_cast<float>(limit_px / lens.params[0]);
  cv::Mat rotation_vector, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(objects, places, cv::Mat::eye(3, 3, CV_64F), cv::noArray(),
                          rotation_vector, translation, false, kRansacIterations, limit,
                          kConfidence, inliers, cv::SOLVEPNP_AP3P) ||
      static_cast<int>(inliers.size()) < min_agree) {
    return std::nullopt;
  }
  std::vector<cv::Point3d> in_objects;
  std::vector<cv::Point2d> in_places;
  for (const int i : inliers) {
    in_objects.push_back(objects[i]);
    in_places.push_back(places[i]);
    seen->push_back(used[i]);
  }
  cv::solvePnPRefineLM(in_objects, in_places, cv::Mat::eye(3, 3, CV_64F), cv::noArray(),
                       rotation_vector, translation);
  const Eigen::Vector3d w(rotation_vector.at<double>(0), rotation_vector.at<double>(1),
                          rotation_vector.at<double>(2));
  Pose pose;
  pose.rotation = Eigen::Quaterniond(ExpOf(w)).normalized();
  pose.translation << translation.at<double>(0), translation.at<double>(1),
      translation.at<double>(2);
  if (!w.allFinite() || !pose.translation.allFinite()) return std::nullopt;
  return pose;
}

}  // namespace dtr::sfm
