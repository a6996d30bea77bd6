#include "dtr/io/formats/pose_from_matrix.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

using Matrix3l = Eigen::Matrix<long double, 3, 3>;
using Vector3l = Eigen::Matrix<long double, 3, 1>;

// Checks, then the nearest rotation.
Eigen::Quaterniond RotationFrom(const Eigen::Matrix3d& rotation, double tolerance,
                                const std::string& what) {
  const double deviation =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(deviation <= tolerance)) {
    throw Error(what + ": expected a rotation matrix (R^T R = I to " + std::to_string(tolerance) +
                "), found a deviation of " + std::to_string(deviation) + "; correct the pose");
  }
  if (!(rotation.determinant() > 0)) {
    throw Error(what +
                ": expected a rotation, found a mirroring (determinant -1); the file has other "
                "axes than its format says");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::Quaterniond(svd.matrixU() * svd.matrixV().transpose()).normalized();
}

// The pose with this rotation whose source has the target's origin at `center`.
Pose PoseAround(const Eigen::Quaterniond& rotation, const Vector3l& center) {
  const Matrix3l matrix = rotation.cast<long double>().normalized().toRotationMatrix();
  return {rotation, (-(matrix * center)).cast<double>()};
}

void RequireFinite(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                   const std::string& what) {
  if (rotation.allFinite() && translation.allFinite()) return;
  throw Error(what + ": expected finite numbers, found NaN or infinity; correct the pose");
}

void RequireLastRow(const Eigen::Matrix4d& matrix, const std::string& what) {
  constexpr double kFloatRounding = 1e-6;  // phones multiply poses in floats: 1.0000001
  const Eigen::RowVector4d difference = matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1);
  if (difference.cwiseAbs().maxCoeff() <= kFloatRounding && matrix.row(3).allFinite()) return;
  throw Error(what + ": expected 0 0 0 1 as the last row of the matrix, found another");
}

}  // namespace

Pose PoseFromMatrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                    double tolerance, const std::string& what) {
  RequireFinite(rotation, translation, what);
  const Eigen::Quaterniond kept = RotationFrom(rotation, tolerance, what);
  return PoseAround(kept,
                    -(rotation.cast<long double>().inverse() * translation.cast<long double>()));
}

Pose PoseFromMatrix(const Eigen::Matrix4d& b_from_a, double tolerance, const std::string& what) {
  RequireLastRow(b_from_a, what);
  return PoseFromMatrix(b_from_a.topLeftCorner<3, 3>(), b_from_a.topRightCorner<3, 1>(), tolerance,
                        what);
}

Pose PoseFromCenter(const Eigen::Matrix3d& world_from_cam, const Eigen::Vector3d& center,
                    double tolerance, const std::string& what) {
  RequireFinite(world_from_cam, center, what);
  return PoseAround(RotationFrom(world_from_cam, tolerance, what).conjugate(),
                    center.cast<long double>());
}

Pose PoseFromWorldFromCam(const Eigen::Matrix4d& world_from_cam, double tolerance,
                          const std::string& what) {
  RequireLastRow(world_from_cam, what);
  return PoseFromCenter(world_from_cam.topLeftCorner<3, 3>(), world_from_cam.topRightCorner<3, 1>(),
                        tolerance, what);
}

Eigen::Matrix4d MatrixFromPose(const Pose& b_from_a) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = b_from_a.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = b_from_a.translation;
  return matrix;
}

}  // namespace dtr::io
