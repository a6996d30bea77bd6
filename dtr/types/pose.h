// dtr/types/pose.h -- rigid transforms, named target_from_source.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace dtr {

/// Rigid transform b_from_a: p_in_b = rotation * p_in_a + translation. Double precision.
/// Chains by eye: c_from_a = c_from_b * b_from_a.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit length
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();         ///< in units of the target

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_in_a) const {
    return rotation * p_in_a + translation;
  }
  Pose operator*(const Pose& a_from_z) const {
    return {(rotation * a_from_z.rotation).normalized(), *this * a_from_z.translation};
  }
  Pose Inverse() const {
    const Eigen::Quaterniond a_from_b = rotation.conjugate();
    return {a_from_b, -(a_from_b * translation)};
  }
  /// Origin of frame b seen in frame a; for cam_from_world the camera's centre in the world.
  Eigen::Vector3d TargetOriginInSource() const { return -(rotation.conjugate() * translation); }
};

}  // namespace dtr
