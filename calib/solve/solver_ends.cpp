#include "calib/solve/solver_ends.h"

#include <glog/logging.h>

#include <cmath>
#include <limits>

namespace dtr::calib {
namespace {

// Operations between a point and its pixel that round: rotation, projection, distortion.
constexpr double kRoundings = 8;

}  // namespace

ceres::Solver::Options SilentOptions() {
  // Ceres logs every step that fails to stderr; the next one is shorter, and the end is checked by
  // the caller. The level belongs to the process: it is set once, before any thread of ours reads
  // it.
  [[maybe_unused]] static const bool quiet = [] {
    FLAGS_minloglevel = google::GLOG_ERROR;
    return true;
  }();
  ceres::Solver::Options options;
  options.num_threads = 1;  // sums in one order
  options.logging_type = ceres::SILENT;
  return options;
}

SolverEnds::SolverEnds(const Progress& progress, size_t coordinates, double largest_px)
    : progress_(progress),
      coordinates_(static_cast<double>(coordinates)),
      rounding_px_(kRoundings * std::numeric_limits<double>::epsilon() * largest_px) {}

ceres::CallbackReturnType SolverEnds::operator()(const ceres::IterationSummary& step) {
  if (progress_.StopRequested()) return ceres::SOLVER_ABORT;
  if (step.iteration == 0 || !step.step_is_valid) return ceres::SOLVER_CONTINUE;
  const double ratio = std::abs(step.relative_decrease);
  const double promised = std::abs(step.cost_change) / (ratio > 0 ? ratio : 1);
  const double hidden = std::sqrt(2 * step.cost * coordinates_) * rounding_px_ +
                        0.5 * coordinates_ * rounding_px_ * rounding_px_;
  return promised <= hidden ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
}

}  // namespace dtr::calib
