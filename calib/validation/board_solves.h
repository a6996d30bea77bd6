// calib/validation/board_solves.h -- internal to calib/validation: solves made to validate a
// calibration by, and how far two solves differ.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/validation/board_residuals.h"
#include "calib/validation/boards.h"

namespace dtr::calib {

/// Share of an image in which limits in pixels hold: corners of it may be beyond any board.
inline constexpr double kMaxOfImage = 0.95;

/// A solve from scratch, or why there is none.
struct Fresh {
  std::optional<RigSolution> solution;
  std::string refused;
};

/// With the corners that the file calls outliers left out, the rest all counts: the stored
/// calibration's own least-squares problem.
Fresh SolveFresh(const ValidatedCalibration& calibration, std::vector<RigView> views, size_t frames,
                 Loss loss);

/// The views of the frames that are wanted.
std::vector<RigView> FramesWhere(const std::vector<RigView>& views,
                                 const std::function<bool(size_t)>& wanted);

/// Frames are dealt in turn; those without a view do not take part.
std::map<size_t, size_t> OrderOfFrames(const std::vector<RigView>& views);

/// Kept views in five folds, each predicted by a solve of the others; `rejected` tells of a fold
/// whose others could not be solved.
BoardResiduals HeldOut(const ValidatedCalibration& calibration, std::string* refused);

/// Mahalanobis distance of `count` unknowns from `at` on; infinite beyond what a covariance says.
double Distance(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance, int at,
                int count);

/// Names the one of these unknowns that differs by the most of its own standard deviations.
std::string LargestPart(const RigLayout& layout, const Eigen::VectorXd& difference,
                        const Eigen::MatrixXd& covariance, int at, int count);

}  // namespace dtr::calib
