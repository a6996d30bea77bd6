#include "calib/bundle/gauge.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calib/similarity.h"

namespace dtr::calib {
namespace {

constexpr int kMaxSteps = 20;
constexpr double kSettledGauge = 1e-15;  // of shift, turn and growth, in normalised units

void Move(const Similarity& b_from_a, Bundle& bundle) {
  for (BundleImage& image : bundle.images) {
    image.cam_from_world = b_from_a.CamFromB(image.cam_from_world);
  }
  for (Eigen::Vector4d& h : bundle.points) {
    const Eigen::Vector3d turned = b_from_a.rotation * h.head<3>();
    h.head<3>() = b_from_a.scale * turned + h[3] * b_from_a.translation;
  }
}

// What takes each camera of `start` to `now`: turns and shifts, 6 rows each.
Eigen::VectorXd Displacements(const Bundle& start, const Bundle& now) {
  Eigen::VectorXd x(6 * static_cast<long>(now.images.size()));
  for (size_t i = 0; i < now.images.size(); ++i) {
    const Pose &a = start.images[i].cam_from_world, &b = now.images[i].cam_from_world;
    const Eigen::AngleAxisd turn(b.rotation * a.rotation.conjugate());
    const long at = 6 * static_cast<long>(i);
    x.segment<3>(at) = turn.angle() * turn.axis();
    x.segment<3>(at + 3) = b.TargetOriginInSource() - a.TargetOriginInSource();
  }
  return x;
}

}  // namespace

Eigen::MatrixXd GaugeColumns(const std::vector<PoseFrame>& poses) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(6 * static_cast<long>(poses.size()), 7);
  for (size_t i = 0; i < poses.size(); ++i) {
    const long at = 6 * static_cast<long>(i);
    const Eigen::Vector3d& c = poses[i].centre;
    columns.block<3, 3>(at + 3, 0) = Eigen::Matrix3d::Identity();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      columns.block<3, 1>(at, 3 + k) = -(poses[i].rotation * axis);
      columns.block<3, 1>(at + 3, 3 + k) = axis.cross(c);
    }
    columns.block<3, 1>(at + 3, 6) = c;
  }
  return columns;
}

Eigen::MatrixXd GaugeDirections(const std::vector<PoseFrame>& poses,
                                const std::vector<int>& image_at, long unknowns) {
  const Eigen::MatrixXd columns = GaugeColumns(poses);
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(unknowns, 7);
  for (size_t i = 0; i < poses.size(); ++i) {
    directions.middleRows<6>(image_at[i]) = columns.middleRows<6>(6 * static_cast<long>(i));
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(directions);
  const Eigen::MatrixXd thin =
      qr.householderQ() * Eigen::MatrixXd::Identity(unknowns, std::min<long>(7, unknowns));
  return thin.leftCols(qr.rank());
}

void MoveToGaugeOf(const Bundle& start, Bundle& now, bool keep_scale) {
  for (int step = 0; step < kMaxSteps; ++step) {
    std::vector<PoseFrame> poses;
    for (const BundleImage& image : now.images) {
      poses.push_back({image.cam_from_world.rotation.toRotationMatrix(),
                       image.cam_from_world.TargetOriginInSource()});
    }
    // The columns at `now`: moving it by -g brings it nearer.
    Eigen::MatrixXd columns = GaugeColumns(poses);
    if (keep_scale) columns.col(6).setZero();
    const Eigen::VectorXd g =
        columns.completeOrthogonalDecomposition().solve(Displacements(start, now));
    if (!g.allFinite()) return;
    Similarity back;
    const Eigen::Vector3d turn = -g.segment<3>(3);
    back.rotation = Eigen::AngleAxisd(
        turn.norm(), turn.norm() > 0 ? turn.normalized() : Eigen::Vector3d::UnitX());
    back.scale = std::exp(-g[6]);
    back.translation = -g.head<3>();
    Move(back, now);
    if (g.norm() < kSettledGauge) break;
  }
}

}  // namespace dtr::calib
