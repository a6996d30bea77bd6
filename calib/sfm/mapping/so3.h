// calib/sfm/mapping/so3.h -- internal to calib/sfm/mapping: rotations and rotation vectors.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dtr::sfm {

/// [v]x: CrossMatrix(v) * u is v x u.
inline Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Rotation about `vector` by its length in rad.
inline Eigen::Matrix3d ExpOf(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + CrossMatrix(vector);
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

/// The rotation vector of a rotation, of length in [0, pi].
inline Eigen::Vector3d LogOf(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(rotation).normalized());
  return turn.angle() * turn.axis();
}

/// The nearest rotation: what rounding left of a product of many.
inline Eigen::Matrix3d Orthonormal(const Eigen::Matrix3d& rotation) {
  return Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
}

}  // namespace dtr::sfm
