#include "dtr/io/formats/pose_from_matrix.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

using Matrix3l = Eigen::Matrix<long double, 3, 3>;
using Vector3l = Eigen::Matrix<long double, 3, 1>;

}  // namespace

Pose PoseFromMatrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                    double tolerance, const std::string& what) {
  if (!rotation.allFinite() || !translation.allFinite()) {
    throw Error(what + ": expected finite numbers, found NaN or infinity; correct the pose");
  }
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
  Pose pose;
  pose.rotation = Eigen::Quaterniond(svd.matrixU() * svd.matrixV().transpose()).normalized();
  // R C + t = 0 with the given R; then t again from the rotation that is kept.
  const Vector3l center =
      -(rotation.cast<long double>().inverse() * translation.cast<long double>());
  const Matrix3l kept = pose.rotation.cast<long double>().normalized().toRotationMatrix();
  pose.translation = (-(kept * center)).cast<double>();
  return pose;
}

Pose PoseFromMatrix(const Eigen::Matrix4d& b_from_a, double tolerance, const std::string& what) {
  if (b_from_a.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw Error(what + ": expected 0 0 0 1 as the last row of the matrix, found another");
  }
  return PoseFromMatrix(b_from_a.topLeftCorner<3, 3>(), b_from_a.topRightCorner<3, 1>(), tolerance,
                        what);
}

Eigen::Matrix4d MatrixFromPose(const Pose& b_from_a) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = b_from_a.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = b_from_a.translation;
  return matrix;
}

}  // namespace dtr::io
