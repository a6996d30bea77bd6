#include "calib/solve/least_squares.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/precision.h"
#include "calib/solve/board_start.h"
#include "calib/solve/solver_ends.h"
#include "dtr/base/error.h"

namespace dtr::calib {

void Reject(const std::string& what) { throw Error("calibration: " + what); }

ceres::Solver::Options SolverOptions() {
  ceres::Solver::Options options = SilentOptions();
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-10;
  options.gradient_tolerance = 1e-12;
  return options;
}

bool Solve(ceres::Solver::Options options, const LensCamera& camera, ceres::Problem* problem) {
  const SilentProgress nobody;
  const double largest_px = std::max(camera.width_px, camera.height_px);
  SolverEnds ends(nobody, static_cast<size_t>(problem->NumResiduals()), largest_px);
  options.callbacks.push_back(&ends);
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  return summary.IsSolutionUsable();
}

double OutlierLimitPx(double outlier_sigmas, double sigma_px) {
  return outlier_sigmas * std::max(sigma_px, kMinOutlierSigmaPx);
}

Used Within(const std::vector<std::vector<double>>& lengths_px, double limit_px) {
  Used used;
  for (const auto& view : lengths_px) {
    used.emplace_back();
    for (const double length : view) used.back().push_back(length < limit_px);
  }
  return used;
}

double SigmaOfUsed(const std::vector<std::vector<double>>& lengths_px, const Used& used) {
  std::vector<double> all;
  for (size_t i = 0; i < lengths_px.size(); ++i) {
    for (size_t j = 0; j < lengths_px[i].size(); ++j) {
      if (used[i][j]) all.push_back(lengths_px[i][j]);
    }
  }
  if (all.empty()) Reject("expected corners that a camera explains, found none");
  return std::max(RobustSigma(std::move(all)), kSmallestSigmaPx);
}

double ScatterOfUsed(const std::vector<std::vector<double>>& lengths_px, const Used& used) {
  double squares = 0, count = 0;
  for (size_t i = 0; i < lengths_px.size(); ++i) {
    for (size_t j = 0; j < lengths_px[i].size(); ++j) {
      if (!used[i][j]) continue;
      squares += lengths_px[i][j] * lengths_px[i][j];
      count += 2;  // coordinates
    }
  }
  return std::max(SigmaOfUsed(lengths_px, used), std::sqrt(squares / std::max(1.0, count)));
}

}  // namespace dtr::calib
