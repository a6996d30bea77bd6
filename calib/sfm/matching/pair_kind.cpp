#include "calib/sfm/matching/pair_kind.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/sfm/matching/robust_fit.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kRotationRad = 0.2 * std::numbers::pi / 180;
constexpr size_t kSeen = 400;  // matches that are looked at

double Angle(const Eigen::Matrix3d& r, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d p = r * a.homogeneous(), q = b.homogeneous();
  return std::atan2(p.cross(q).norm(), p.dot(q));
}

double MedianAngle(const Eigen::Matrix3d& r, const PointPairs& points) {
  std::vector<double> angles;
  for (size_t i = 0; i < points.size(); ++i) angles.push_back(Angle(r, points.a[i], points.b[i]));
  if (angles.empty()) return 0;
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::nth_element(angles.begin(), middle, angles.end());
  return *middle;
}

// The rotation that turns rays of a into those of b, by reweighted orthogonal Procrustes steps
// (Kabsch 1976).
Eigen::Matrix3d RotationAlone(Eigen::Matrix3d r, const PointPairs& points) {
  for (int k = 0; k < 15; ++k) {
    const double scale = std::max(2 * MedianAngle(r, points), 1e-6);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < points.size(); ++i) {
      const double s = Angle(r, points.a[i], points.b[i]) / scale;
      const double root = 1 / (1 + s * s);
      sum += root * root * points.b[i].homogeneous().normalized() *
             points.a[i].homogeneous().normalized().transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
    r = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  }
  return r;
}

}  // namespace

void ClassifyPair(const RelativePose& pose, const PointPairs& points, double threshold,
                  std::uint64_t seed, PairGeometry& pair) {
  PointPairs some;
  const size_t step = (points.size() + kSeen - 1) / kSeen;
  for (size_t i = 0; i < points.size(); i += step) some.Add(points.a[i], points.b[i]);
  pair.kind = PairKind::kCalibrated;
  pair.b_rotation_a = pose.r;
  pair.b_translation_a = pose.t;
  pair.parallax_rad = MedianAngle(pose.r, points);
  const auto homography = FitHomography(some, threshold, seed);
  if (!homography || static_cast<double>(homography->inliers.size()) <
                         kPlanarShare * static_cast<double>(some.size())) {
    return;
  }
  pair.kind = PairKind::kPlanar;
  const Eigen::Matrix3d r = RotationAlone(pose.r, some);
  const double left = MedianAngle(r, points);
  if (left >= kRotationRad) return;
  pair.kind = PairKind::kRotation;
  pair.b_rotation_a = r;
  pair.b_translation_a.setZero();
  pair.parallax_rad = left;
}

}  // namespace dtr::sfm::matching
