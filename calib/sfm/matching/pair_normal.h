// calib/sfm/matching/pair_normal.h -- internal to calib/sfm/matching: least squares over the poses
// of pairs and the lenses of their photos.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "calib/sfm/matching/lens_pair.h"

namespace dtr::sfm::matching {

/// Normal equations of a pair: its pose, and `kOfLens` unknowns of its lenses.
template <int kOfLens>
struct PairNormal {
  using Matrix = Eigen::Matrix<double, kOfLens, kOfLens>;
  using Vector = Eigen::Matrix<double, kOfLens, 1>;

  /// Of the lenses alone, the pose eliminated (Schur complement).
  struct Reduced {
    Matrix h = Matrix::Zero();
    Vector g = Vector::Zero();
  };

  Eigen::Matrix<double, 5 + kOfLens, 5 + kOfLens> h =
      Eigen::Matrix<double, 5 + kOfLens, 5 + kOfLens>::Zero();
  Eigen::Matrix<double, 5 + kOfLens, 1> g = Eigen::Matrix<double, 5 + kOfLens, 1>::Zero();
  double weights = 0, squares = 0;

  void DampPose(double damping) {
    h.diagonal().template head<5>() *= 1 + damping;
    h.diagonal().template head<5>().array() += 1e-9;
  }

  Reduced WithoutPose() const {
    const auto pose = h.template topLeftCorner<5, 5>().ldlt();
    const Eigen::Matrix<double, 5, kOfLens> across = h.template topRightCorner<5, kOfLens>();
    return {
        h.template bottomRightCorner<kOfLens, kOfLens>() - across.transpose() * pose.solve(across),
        g.template tail<kOfLens>() - across.transpose() * pose.solve(g.template head<5>())};
  }

  /// How the pose moves where the lenses move by `step`; zero where that is not determined.
  Eigen::Matrix<double, 5, 1> PoseStep(const Vector& step) const {
    const Eigen::Matrix<double, 5, 1> right =
        g.template head<5>() + h.template topRightCorner<5, kOfLens>() * step;
    Eigen::Matrix<double, 5, 1> move = -h.template topLeftCorner<5, 5>().ldlt().solve(right);
    if (!move.allFinite()) move.setZero();
    return move;
  }
};

/// Step of the numerical derivatives by unknowns of a lens.
inline constexpr double kLensStep = 1e-5;

/// Linearised at `at` and `pose`; `nearby`: the lenses with each unknown larger by kLensStep.
template <int kOfLens>
PairNormal<kOfLens> NormalOf(const VotePair& pair, const LensPair& at,
                             const std::array<LensPair, kOfLens>& nearby,
                             const RelativePose& pose) {
  PairNormal<kOfLens> normal;
  const PoseDerivatives derivatives(pose);
  const auto residual = [&](const LensPair& by, size_t i, PoseRow* row, double& scale) {
    double ma = 1, mb = 1;
    const auto a = Unbent(by.a, pair.points.a[i], &ma), b = Unbent(by.b, pair.points.b[i], &mb);
    if (!a || !b) return std::numeric_limits<double>::quiet_NaN();
    scale = kScale * std::sqrt(ma * mb);
    return derivatives.Residual(*a, *b, row) / scale;
  };
  for (size_t i = 0; i < pair.points.size(); ++i) {
    PoseRow pose_row;
    double scale = 1, other = 1;
    const double r = residual(at, i, &pose_row, scale);
    if (!std::isfinite(r)) continue;
    const double root = 1 / (1 + r * r), weight = root * root;
    if (weight < 1e-3) continue;
    Eigen::Matrix<double, 5 + kOfLens, 1> row;
    row.template head<5>() = pose_row.transpose() / scale;
    for (int k = 0; k < kOfLens; ++k) {
      const double moved = residual(nearby[static_cast<size_t>(k)], i, nullptr, other);
      row[5 + k] = std::isfinite(moved) ? (moved - r) / kLensStep : 0;
    }
    normal.h.noalias() += weight * row * row.transpose();
    normal.g += weight * r * row;
    normal.weights += weight;
    normal.squares += weight * r * r;
  }
  return normal;
}

/// Weighted mean square of all residuals, in units of the scale; infinite without any.
template <int kOfLens>
double NoiseVariance(const std::vector<PairNormal<kOfLens>>& normals) {
  double weights = 0, squares = 0;
  for (const PairNormal<kOfLens>& n : normals) {
    weights += n.weights;
    squares += n.squares;
  }
  return weights > 0 ? squares / weights : std::numeric_limits<double>::infinity();
}

/// Levenberg-Marquardt: `step(damping)` moves and returns true where that lowers `cost`.
template <typename Step>
void Minimise(int max_steps, const Progress* progress, const double& cost, const Step& step) {
  double damping = 1e-3;
  for (int k = 0; k < max_steps && damping < 1e6; ++k) {
    if (progress != nullptr) progress->ThrowIfInterrupted();
    const double before = cost;
    if (!step(damping)) {
      damping *= 10;
      continue;
    }
    damping *= 0.2;
    if (before - cost < 1e-7 * before) break;
  }
}

}  // namespace dtr::sfm::matching
