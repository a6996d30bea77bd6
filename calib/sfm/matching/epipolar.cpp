#include "calib/sfm/matching/epipolar.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

namespace dtr::sfm::matching {
namespace {

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Vector3d Ray(const Eigen::Vector2d& p) { return {p.x(), p.y(), 1}; }

// Moves the weighted mean to 0 and the mean distance to sqrt(2).
std::optional<Eigen::Matrix3d> Normalising(const std::vector<Eigen::Vector2d>& points,
                                           std::span<const double> weights) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double total = 0, spread = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    sum += weights[i] * points[i];
    total += weights[i];
  }
  if (!(total > 0)) return std::nullopt;
  const Eigen::Vector2d mean = sum / total;
  for (size_t i = 0; i < points.size(); ++i) spread += weights[i] * (points[i] - mean).norm();
  if (!(spread > 0)) return std::nullopt;
  const double scale = std::sqrt(2.0) * total / spread;
  Eigen::Matrix3d m;
  m << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return m;
}

}  // namespace

Eigen::Matrix3d RelativePose::Essential() const { return Cross(t) * r; }

double SampsonSquared(const Eigen::Matrix3d& m, const Eigen::Vector2d& a,
                      const Eigen::Vector2d& b) {
  const double l0 = m(0, 0) * a.x() + m(0, 1) * a.y() + m(0, 2);
  const double l1 = m(1, 0) * a.x() + m(1, 1) * a.y() + m(1, 2);
  const double l2 = m(2, 0) * a.x() + m(2, 1) * a.y() + m(2, 2);
  const double k0 = m(0, 0) * b.x() + m(1, 0) * b.y() + m(2, 0);
  const double k1 = m(0, 1) * b.x() + m(1, 1) * b.y() + m(2, 1);
  const double e = b.x() * l0 + b.y() * l1 + l2;
  const double n = l0 * l0 + l1 * l1 + k0 * k0 + k1 * k1;
  return n > 0 ? e * e / n : std::numeric_limits<double>::infinity();
}

std::optional<Eigen::Matrix3d> FundamentalFromMany(const PointPairs& points,
                                                   std::span<const double> weights) {
  if (points.size() < 8) return std::nullopt;
  const auto na = Normalising(points.a, weights), nb = Normalising(points.b, weights);
  if (!na || !nb) return std::nullopt;
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  for (size_t i = 0; i < points.size(); ++i) {
    if (weights[i] <= 0) continue;
    const Eigen::Vector3d p = *na * Ray(points.a[i]), q = *nb * Ray(points.b[i]);
    Eigen::Matrix<double, 9, 1> row;
    row << q.x() * p, q.y() * p, p;
    sum.selfadjointView<Eigen::Lower>().rankUpdate(row, weights[i]);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(sum);
  const Eigen::Matrix<double, 9, 1> v = solver.eigenvectors().col(0);
  if (!v.allFinite()) return std::nullopt;
  Eigen::Matrix3d f;
  f << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d s = svd.singularValues();
  s[2] = 0;
  f = nb->transpose() * svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose() * *na;
  const double norm = f.norm();
  if (!(norm > 0) || !std::isfinite(norm)) return std::nullopt;
  return f / norm;
}

std::optional<Eigen::Vector2d> DepthsOf(const RelativePose& pose, const Eigen::Vector2d& a,
                                        const Eigen::Vector2d& b) {
  const Eigen::Vector3d p = pose.r * Ray(a), q = Ray(b);
  // Least squares of da p - db q = -t.
  const double pp = p.squaredNorm(), qq = q.squaredNorm(), pq = p.dot(q);
  const double det = pp * qq - pq * pq;
  if (!(det > 1e-14 * pp * qq)) return std::nullopt;
  const double pt = p.dot(pose.t), qt = q.dot(pose.t);
  return Eigen::Vector2d((pq * qt - qq * pt) / det, (pp * qt - pq * pt) / det);
}

RelativePose PoseFromEssential(const Eigen::Matrix3d& essential, const PointPairs& points,
                               std::span<const double> weights) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0) u = -u;
  if (v.determinant() < 0) v = -v;
  Eigen::Matrix3d w;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  RelativePose best;
  double most = -1;
  for (int k = 0; k < 4; ++k) {
    RelativePose pose;
    pose.r = u * (k < 2 ? w : Eigen::Matrix3d(w.transpose())) * v.transpose();
    pose.t = (k % 2 == 0 ? 1.0 : -1.0) * u.col(2);
    double in_front = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      const double weight = weights.empty() ? 1 : weights[i];
      if (weight <= 0) continue;
      const auto depths = DepthsOf(pose, points.a[i], points.b[i]);
      if (depths && depths->x() > 0 && depths->y() > 0) in_front += weight;
    }
    if (in_front > most) {
      most = in_front;
      best = pose;
    }
  }
  return best;
}

PoseDerivatives::PoseDerivatives(const RelativePose& pose) : pose_(pose), e_(pose.Essential()) {
  const Eigen::Vector3d& t = pose.t;
  Eigen::Index smallest;
  t.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d first = t.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  across_ << first, t.cross(first);
  for (int i = 0; i < 3; ++i) de_[i] = Cross(t) * Cross(Eigen::Vector3d::Unit(i)) * pose.r;
  for (int i = 0; i < 2; ++i) de_[3 + i] = Cross(across_.col(i)) * pose.r;
}

double PoseDerivatives::Residual(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                 PoseRow* row) const {
  const Eigen::Vector3d p = Ray(a), q = Ray(b);
  const Eigen::Vector3d line = e_ * p;
  const Eigen::Vector2d back = (e_.transpose() * q).head<2>();
  const double e = q.dot(line);
  const double n = line.head<2>().squaredNorm() + back.squaredNorm();
  if (!(n > 0)) {
    if (row != nullptr) row->setZero();
    return 0;
  }
  const double root = 1 / std::sqrt(n), r = e * root;
  if (row != nullptr) {
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d dl = de_[i] * p;
      const Eigen::Vector2d db = (de_[i].transpose() * q).head<2>();
      const double half_dn = line.head<2>().dot(dl.head<2>()) + back.dot(db);
      (*row)[i] = q.dot(dl) * root - r * half_dn / n;
    }
  }
  return r;
}

RelativePose PoseDerivatives::Moved(const Eigen::Matrix<double, 5, 1>& step) const {
  RelativePose moved = pose_;
  const Eigen::Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  if (angle > 0) moved.r = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * pose_.r;
  moved.t = (pose_.t + across_ * step.tail<2>()).normalized();
  return moved;
}

double PoseCost(const RelativePose& pose, const PointPairs& points, double scale) {
  const Eigen::Matrix3d e = pose.Essential();
  double cost = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const double s = SampsonSquared(e, points.a[i], points.b[i]) / (scale * scale);
    cost += std::isfinite(s) ? RobustCost(s) : 1;
  }
  return cost;
}

RelativePose RefinePose(RelativePose pose, const PointPairs& points, double scale, int iterations) {
  double cost = PoseCost(pose, points, scale), damping = 1e-4;
  for (int k = 0; k < iterations; ++k) {
    const PoseDerivatives at(pose);
    Eigen::Matrix<double, 5, 5> h = Eigen::Matrix<double, 5, 5>::Zero();
    Eigen::Matrix<double, 5, 1> g = Eigen::Matrix<double, 5, 1>::Zero();
    for (size_t i = 0; i < points.size(); ++i) {
      PoseRow row;
      const double r = at.Residual(points.a[i], points.b[i], &row) / scale;
      const double root = 1 / (1 + r * r), weight = root * root;
      if (weight < 1e-3) continue;
      row /= scale;
      h.noalias() += weight * row.transpose() * row;
      g.noalias() += weight * r * row.transpose();
    }
    h.diagonal() *= 1 + damping;
    h.diagonal().array() += 1e-12;
    const Eigen::Matrix<double, 5, 1> step = -h.ldlt().solve(g);
    if (!step.allFinite() || step.norm() > 1) break;
    const RelativePose moved = at.Moved(step);
    const double next = PoseCost(moved, points, scale);
    if (next < cost) {
      const bool converged = cost - next < 1e-6 * cost;
      pose = moved;
      cost = next;
      damping *= 0.1;
      if (converged) break;
    } else {
      damping = std::max(damping * 100, 1e-2);
      if (damping > 1e3) break;
    }
  }
  return pose;
}

}  // namespace dtr::sfm::matching
