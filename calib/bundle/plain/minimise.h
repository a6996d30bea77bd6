// calib/bundle/plain/minimise.h -- internal to calib/bundle: Levenberg's and Marquardt's method for
// the plain problem.
#pragma once
#include "calib/bundle/plain/problem.h"
#include "dtr/base/progress.h"

namespace dtr::calib::plain {

struct MinimiseOptions {
  int max_iterations = 100;
  /// Converged where, after a step, the next is expected to promise less than this share of the
  /// cost; the step is still taken.
  double cost_tolerance = 1e-9;
  double start_lambda = 1e-4;
  const Progress* progress = nullptr;  ///< asked every iteration; null: unset
};

struct MinimiseResult {
  double start_cost = 0, cost = 0;  ///< half the sum of squares; start infinite: nothing was done
  int iterations = 0;
  bool converged = false;
};

/// Minimises the problem's cost from `x`. Where no camera and no lens moves, every point is placed
/// by itself. The same bits for any number of threads. Throws Interrupted.
MinimiseResult Minimise(const Problem& problem, const MinimiseOptions& options, Unknowns& x);

/// Rounding of the cost: residuals of its size, each rounded as pixels are (SolverEnds,
/// solver_ends.h).
double RoundingOf(double cost, size_t coordinates, double largest_px);

}  // namespace dtr::calib::plain
