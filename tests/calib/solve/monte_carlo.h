// tests/calib/solve/monte_carlo.h -- many solves of the same truth under drawn noise.
#pragma once
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/solve/board_solve.h"
#include "dtr/base/parallel_for.h"
#include "tests/calib/solve/synthetic_views.h"

namespace dtr::calib::testing {

struct MonteCarlo {
  /// Worst over the lens parameters, and over all of them together: share of the solves in which
  /// the truth is within 3 predicted standard deviations.
  double worst_share = 1, all_share = 1;
  /// Normalised squared error over its expectation; 1 when predictions are honest. Of all
  /// parameters, poses included, and of the lens alone.
  double chi_squared = 0, lens_chi_squared = 0;
  /// Mean RMS over what the noise and the degrees of freedom make of it.
  double rms_ratio = 0;
};

// Squared error of everything in units of the prediction, and by lens parameter in sigmas.
struct SolveError {
  double all = 0, lens = 0, rms_ratio = 0;
  Eigen::VectorXd sigmas;
};

inline SolveError ErrorOf(const BoardSolution& solution, const LensCamera& truth,
                          const SyntheticViews& exact, double sigma_px) {
  const Eigen::Vector3d middle = MiddleOf(kBoard);
  const long count = FreeParameterCount(solution.model);
  Eigen::VectorXd lens(count);
  for (long i = 0; i < count; ++i) {
    lens[i] = truth.params[static_cast<size_t>(i)] - solution.camera.params[static_cast<size_t>(i)];
  }
  std::vector<Eigen::VectorXd> motions;
  for (size_t i = 0; i < solution.views.size(); ++i) {
    const Pose &found = solution.views[i].cam_from_board, &real = exact.cam_from_board[i];
    const Eigen::AngleAxisd turn(real.rotation * found.rotation.conjugate());
    Eigen::VectorXd motion(6);
    motion << turn.angle() * turn.axis(),
        (real * middle - found * middle) / (found * middle).norm();
    motions.push_back(motion);
  }
  const double s = solution.sigma_px;
  SolveError error;
  error.all = solution.information.SquaredLength(lens, motions) / (s * s);
  error.lens = lens.dot(solution.covariance.inverse() * lens);
  error.sigmas = lens.cwiseAbs().cwiseQuotient(solution.covariance.diagonal().cwiseSqrt());
  const double unknowns = static_cast<double>(count) + 6.0 * static_cast<double>(motions.size());
  const double numbers = 2.0 * solution.corners;
  error.rms_ratio =
      solution.rms_px / (sigma_px * std::sqrt(2.0) * std::sqrt((numbers - unknowns) / numbers));
  return error;
}

inline MonteCarlo RunMonteCarlo(BoardModel model, int solves, int views, double sigma_px) {
  const LensCamera truth = TypicalCamera(model);
  const SyntheticViews exact = ExactViews(truth, views, 11);
  std::vector<SolveError> errors(static_cast<size_t>(solves));
  ParallelFor(0, solves, [&](int k) {
    const auto noisy = Noisy(exact.views, sigma_px, 1000 + static_cast<std::uint64_t>(k));
    const BoardSolution solution = SolveBoard(kBoard, noisy, 640, 480, model);
    errors[static_cast<size_t>(k)] = ErrorOf(solution, truth, exact, sigma_px);
  });
  MonteCarlo result;
  const long count = FreeParameterCount(model);
  Eigen::VectorXd inside = Eigen::VectorXd::Zero(count);
  for (const SolveError& error : errors) {
    inside += (error.sigmas.array() <= 3).cast<double>().matrix();
    result.chi_squared += error.all / static_cast<double>(count + 6 * views);
    result.lens_chi_squared += error.lens / static_cast<double>(count);
    result.rms_ratio += error.rms_ratio;
  }
  const auto n = static_cast<double>(solves);
  result.worst_share = inside.minCoeff() / n;
  result.all_share = inside.mean() / n;
  result.chi_squared /= n;
  result.lens_chi_squared /= n;
  result.rms_ratio /= n;
  std::printf(
      "%s, %d solves: inside 3 sigma %.4f (worst parameter %.4f), chi squared %.4f (lens "
      "alone %.4f), RMS over theory %.5f\n",
      NameOf(model).c_str(), solves, result.all_share, result.worst_share, result.chi_squared,
      result.lens_chi_squared, result.rms_ratio);
  return result;
}

// Acceptance of board calibration: 99 %, 0.9 to 1.1, 1 %.
constexpr double kInsideThreeSigmas = 0.99, kMinChiSquared = 0.9, kMaxChiSquared = 1.1;
constexpr double kSameRms = 0.01;

}  // namespace dtr::calib::testing
