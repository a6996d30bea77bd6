// dtr/io/formats/pose_from_matrix.h -- checked poses out of foreign matrices.
#pragma once
#include <Eigen/Core>
#include <string>

#include "dtr/types/pose.h"

namespace dtr::io {

/// Largest |R^T R - I| entry of a matrix written by a careful program in double precision.
inline constexpr double kRotationTolerance = 1e-6;
/// The same for formats that hold float32 or about 6 printed digits (7-Scenes, Open3D, LLFF).
inline constexpr double kPrintedRotationTolerance = 1e-3;

/// b_from_a out of a rotation and a translation: p_in_b = rotation * p_in_a + translation. Throws
/// Error starting with `what` unless all is finite, R^T R = I within `tolerance` and det R > 0.
/// Of the remaining deviation R is freed by taking the nearest rotation (Frobenius norm: U V^T of
/// the SVD; Arun, Huang, Blostein 1987). The origin of b in frame a, for cam_from_world the
/// camera's centre, stays where the given matrix puts it, which matters far from 0.
Pose PoseFromMatrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                    double tolerance, const std::string& what);

/// The same from a 4x4 matrix, whose last row must be 0 0 0 1.
Pose PoseFromMatrix(const Eigen::Matrix4d& b_from_a, double tolerance, const std::string& what);

/// cam_from_world of a camera given the other way round: its axes as the columns of
/// `world_from_cam` and its centre in the world. Checks as above; the centre is kept as given.
Pose PoseFromCenter(const Eigen::Matrix3d& world_from_cam, const Eigen::Vector3d& center,
                    double tolerance, const std::string& what);

/// The same from a 4x4 world_from_cam matrix, whose last row must be 0 0 0 1.
Pose PoseFromWorldFromCam(const Eigen::Matrix4d& world_from_cam, double tolerance,
                          const std::string& what);

/// [rotation | translation; 0 0 0 1].
Eigen::Matrix4d MatrixFromPose(const Pose& b_from_a);

}  // namespace dtr::io
