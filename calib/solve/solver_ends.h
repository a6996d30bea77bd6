// calib/solve/solver_ends.h -- internal to calib/solve and calib/bundle: when Ceres is done.
#pragma once
#include <ceres/ceres.h>

#include "dtr/base/progress.h"

namespace dtr::calib {

/// One thread, silent: the same bits every time. Linear solver and tolerances are the caller's.
ceres::Solver::Options SilentOptions();

/// Stops a solve when `progress` asks for it, and ends it where rounding hides any further gain.
///
/// Ceres' tolerances are relative to the cost, and the parameters' one to unknowns that start at
/// zero here: near exact observations neither is ever reached, as the cost's own rounding is
/// larger. Residuals of a size r, rounded by d each, make a cost that is rounded by the sum of r d:
/// a step that promises less than that cannot be told from none.
class SolverEnds final : public ceres::IterationCallback {
 public:
  /// `coordinates`: number of residuals; `largest_px`: of the pixels' coordinates.
  SolverEnds(const Progress& progress, size_t coordinates, double largest_px);
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override;

 private:
  const Progress& progress_;
  double coordinates_, rounding_px_;
};

}  // namespace dtr::calib
