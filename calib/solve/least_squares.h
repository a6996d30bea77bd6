// calib/solve/least_squares.h -- internal to calib/solve: what the solves of boards and rigs share.
#pragma once
#include <ceres/ceres.h>

#include <string>
#include <vector>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// Throws Error: "calibration: " and what is missing.
[[noreturn]] void Reject(const std::string& what);

/// Levenberg-Marquardt to the last digits, silent: the same bits every time.
ceres::Solver::Options SolverOptions();

/// Solves until nothing is gained, or rounding hides it (SolverEnds); observations are pixels of
/// images like this camera's. False where there is no usable solution.
bool Solve(ceres::Solver::Options options, const LensCamera& camera, ceres::Problem* problem);

constexpr double kCauchySigmas = 3;        // scale of the robust loss
constexpr double kSameScale = 0.05;        // relative change at which the robust loss is settled
constexpr double kSmallestSigmaPx = 1e-7;  // that the loss is scaled by, where corners are exact
constexpr int kMaxRobustPasses = 6, kMaxOutlierPasses = 10;

using Used = std::vector<std::vector<bool>>;  // per view, per corner

/// Farther from its prediction than this, a corner is an outlier.
double OutlierLimitPx(double outlier_sigmas, double sigma_px);

/// Corners nearer than `limit_px` to their predictions.
Used Within(const std::vector<std::vector<double>>& lengths_px, double limit_px);

/// RobustSigma of the lengths that are used, at least kSmallestSigmaPx. Rejects where there are
/// none.
double SigmaOfUsed(const std::vector<std::vector<double>>& lengths_px, const Used& used);

/// Standard deviation per coordinate of the lengths that are used, tails and all: at least
/// SigmaOfUsed. Photos differ in sharpness and boards are bent; where the smaller residuals alone
/// are the measure, the larger ones of every photo become outliers, and with them what the image's
/// border says of the lens. Requires gross outliers to be taken out before.
double ScatterOfUsed(const std::vector<std::vector<double>>& lengths_px, const Used& used);

}  // namespace dtr::calib
