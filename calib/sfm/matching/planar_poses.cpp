#include "calib/sfm/matching/planar_poses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace dtr::sfm::matching {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Columns(const Vector3d& first, const Vector3d& second) {
  Matrix3d m;
  m << first, second, first.cross(second);
  return m;
}

// Whether more of the points lie on the side of the plane that `normal` shows to.
bool IsSeenAlong(const Vector3d& normal, const PointPairs& points) {
  int sum = 0;
  for (const Eigen::Vector2d& p : points.a) sum += normal.dot(p.homogeneous()) > 0 ? 1 : -1;
  return sum > 0;
}

}  // namespace

std::optional<std::array<RelativePose, 2>> PosesOfPlane(const Matrix3d& h,
                                                        const PointPairs& on_plane) {
  constexpr double kLeast = 1e-6;  // of the singular values' spread: else it is a rotation
  int sum = 0;
  for (size_t i = 0; i < on_plane.size(); ++i) {
    sum += on_plane.b[i].homogeneous().dot(h * on_plane.a[i].homogeneous()) > 0 ? 1 : -1;
  }
  const Eigen::JacobiSVD<Matrix3d> svd(h, Eigen::ComputeFullV);
  const double middle = svd.singularValues()[1];
  if (!h.allFinite() || !(middle > 0)) return std::nullopt;
  const Matrix3d scaled = h * ((sum > 0 ? 1 : -1) / middle);
  const double s1 = svd.singularValues()[0] / middle, s3 = svd.singularValues()[2] / middle;
  const double spread = s1 * s1 - s3 * s3;
  if (!(spread > kLeast)) return std::nullopt;
  const Vector3d v1 = svd.matrixV().col(0), v2 = svd.matrixV().col(1), v3 = svd.matrixV().col(2);
  const double along1 = std::sqrt(std::max(0.0, 1 - s3 * s3) / spread);
  const double along3 = std::sqrt(std::max(0.0, s1 * s1 - 1) / spread);
  std::array<RelativePose, 2> poses;
  for (size_t i = 0; i < poses.size(); ++i) {
    const Vector3d u = along1 * v1 + (i == 0 ? 1 : -1) * along3 * v3;
    const Matrix3d r = Columns(scaled * v2, scaled * u) * Columns(v2, u).transpose();
    const Vector3d normal = v2.cross(u);
    const Vector3d t = (scaled - r) * normal * (IsSeenAlong(normal, on_plane) ? 1 : -1);
    if (!r.allFinite() || !(t.norm() > 0)) return std::nullopt;
    poses[i] = {r, t.normalized()};
  }
  return poses;
}

}  // namespace dtr::sfm::matching
