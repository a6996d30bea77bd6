#include "calib/sfm/registration/absolute_pose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/calib3d.hpp>

namespace dtr::sfm {
namespace {

constexpr int kRansacIterations = 2000;
constexpr double kConfidence = 0.99999;
constexpr size_t kMinPoints = 4;

std::vector<cv::Point3d> ObjectsOf(const PointRays& seen) {
  std::vector<cv::Point3d> objects;
  for (const Eigen::Vector3d& p : seen.points) objects.emplace_back(p.x(), p.y(), p.z());
  return objects;
}

std::vector<cv::Point2d> ImagesOf(const PointRays& seen) {
  std::vector<cv::Point2d> images;
  for (const Eigen::Vector2d& r : seen.rays) images.emplace_back(r.x(), r.y());
  return images;
}

std::optional<Pose> PoseOf(const cv::Mat& rotation, const cv::Mat& translation) {
  const Eigen::Vector3d r(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  Pose pose;
  if (r.norm() > 0) pose.rotation = Eigen::AngleAxisd(r.norm(), r.normalized());
  pose.translation = {translation.at<double>(0), translation.at<double>(1),
                      translation.at<double>(2)};
  if (!r.allFinite() || !pose.translation.allFinite()) return std::nullopt;
  return pose;
}

}  // namespace

std::optional<AbsolutePose> FindPose(const PointRays& seen, double limit, int min_inliers) {
  if (seen.size() < std::max(kMinPoints, static_cast<size_t>(std::max(min_inliers, 0)))) return {};
  cv::Mat rotation, translation;
  AbsolutePose found;
  const bool any =
      cv::solvePnPRansac(ObjectsOf(seen), ImagesOf(seen), cv::Matx33d::eye(), cv::noArray(),
                         rotation, translation, false, kRansacIterations, static_cast<float>(limit),
                         kConfidence, found.inliers, cv::SOLVEPNP_AP3P);
  if (!any || static_cast<int>(found.inliers.size()) < min_inliers) return std::nullopt;
  std::sort(found.inliers.begin(), found.inliers.end());
  const auto pose = PoseOf(rotation, translation);
  if (!pose) return std::nullopt;
  found.cam_from_world = *pose;
  return found;
}

std::optional<Pose> RefineAbsolutePose(const PointRays& seen, const Pose& start) {
  if (seen.size() < kMinPoints) return std::nullopt;
  const Eigen::AngleAxisd angle_axis(start.rotation);
  const Eigen::Vector3d r = angle_axis.angle() * angle_axis.axis();
  cv::Mat rotation = (cv::Mat_<double>(3, 1) << r.x(), r.y(), r.z());
  const Eigen::Vector3d& t = start.translation;
  cv::Mat translation = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
  cv::solvePnPRefineLM(ObjectsOf(seen), ImagesOf(seen), cv::Matx33d::eye(), cv::noArray(), rotation,
                       translation);
  return PoseOf(rotation, translation);
}

}  // namespace dtr::sfm
