#include "calib/solve/arrow_information.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace dtr::calib {
namespace {

constexpr double kSmallestSingular = 1e-12;  // of columns of length 1: thousands of roundings

struct TriangleInverse {
  Eigen::MatrixXd inverse;                   // (R^T R)^-1
  Eigen::VectorXd singular_values, weakest;  // of R with columns of length 1
  bool valid = false;
};

TriangleInverse InverseOf(const Eigen::MatrixXd& r) {
  TriangleInverse out;
  const Eigen::VectorXd lengths = r.colwise().norm();
  if (!r.allFinite() || !(lengths.array() > 0).all()) return out;
  const Eigen::VectorXd scale = lengths.cwiseInverse();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(r * scale.asDiagonal(), Eigen::ComputeFullV);
  out.singular_values = svd.singularValues();
  out.weakest = svd.matrixV().rightCols<1>();
  const double smallest = out.singular_values.tail<1>()[0];
  if (!(smallest > kSmallestSingular)) return out;
  const Eigen::MatrixXd half =
      scale.asDiagonal() * svd.matrixV() * out.singular_values.cwiseInverse().asDiagonal();
  out.inverse = half * half.transpose();
  out.valid = true;
  return out;
}

// The upper triangle R of a matrix with at least as many columns as wanted; zero rows are added
// where there are too few.
Eigen::MatrixXd TriangleOf(const Eigen::MatrixXd& matrix) {
  const long columns = matrix.cols();
  Eigen::MatrixXd tall = Eigen::MatrixXd::Zero(std::max(matrix.rows(), columns), columns);
  tall.topRows(matrix.rows()) = matrix;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(tall);
  return qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
}

}  // namespace

ArrowInformation::ArrowInformation(int lens_parameters)
    : reduced_(Eigen::MatrixXd::Zero(lens_parameters, lens_parameters)) {}

int ArrowInformation::AddPose(const Eigen::MatrixXd& by_lens, const Eigen::MatrixXd& by_pose) {
  const long unknowns = by_pose.cols(), rows = by_pose.rows();
  Eigen::MatrixXd all(rows, unknowns + by_lens.cols());
  all << by_pose, by_lens;
  const Eigen::MatrixXd triangle = TriangleOf(all);
  PoseBlock pose;
  pose.r = triangle.topLeftCorner(unknowns, unknowns);
  pose.t = triangle.topRightCorner(unknowns, by_lens.cols());
  Eigen::MatrixXd stacked(reduced_.rows() + by_lens.cols(), by_lens.cols());
  stacked << reduced_, triangle.bottomRightCorner(by_lens.cols(), by_lens.cols());
  reduced_ = TriangleOf(stacked);
  poses_.push_back(std::move(pose));
  return pose_count() - 1;
}

bool ArrowInformation::Invert() {
  for (PoseBlock& pose : poses_) {
    TriangleInverse own = InverseOf(pose.r);
    if (!own.valid) return false;
    pose.own_inverse = std::move(own.inverse);
    pose.by_lens = pose.r.triangularView<Eigen::Upper>().solve(pose.t);
  }
  TriangleInverse lens = InverseOf(reduced_);
  if (lens.singular_values.size() > 0) {
    condition_ = lens.singular_values[0] / lens.singular_values.tail<1>()[0];
    weakest_ = std::move(lens.weakest);
  }
  lens_covariance_ = std::move(lens.inverse);
  return lens.valid;
}

Eigen::MatrixXd ArrowInformation::LensPoseCovariance(int pose) const {
  return -lens_covariance_ * poses_[static_cast<size_t>(pose)].by_lens.transpose();
}

Eigen::MatrixXd ArrowInformation::PoseCovariance(int pose) const {
  const PoseBlock& block = poses_[static_cast<size_t>(pose)];
  return block.own_inverse + block.by_lens * lens_covariance_ * block.by_lens.transpose();
}

Eigen::MatrixXd ArrowInformation::VarianceOf(const Eigen::MatrixXd& by_lens,
                                             const std::vector<Eigen::MatrixXd>& by_pose) const {
  // Each pose follows the lens by -V^-1 W^T, and adds what it is uncertain by with the lens known.
  Eigen::MatrixXd reduced = by_lens;
  Eigen::MatrixXd variance = Eigen::MatrixXd::Zero(by_lens.rows(), by_lens.rows());
  for (size_t i = 0; i < poses_.size(); ++i) {
    reduced -= by_pose[i] * poses_[i].by_lens;
    variance += by_pose[i] * poses_[i].own_inverse * by_pose[i].transpose();
  }
  return variance + reduced * lens_covariance_ * reduced.transpose();
}

double ArrowInformation::SquaredLength(const Eigen::VectorXd& lens_error,
                                       const std::vector<Eigen::VectorXd>& pose_errors) const {
  double sum = (reduced_ * lens_error).squaredNorm();
  for (size_t i = 0; i < poses_.size(); ++i) {
    sum += (poses_[i].r * pose_errors[i] + poses_[i].t * lens_error).squaredNorm();
  }
  return sum;
}

}  // namespace dtr::calib
