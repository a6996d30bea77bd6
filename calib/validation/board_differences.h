// calib/validation/board_differences.h -- internal to calib/validation: the stored calibration of
// boards against solves from scratch.
#pragma once
#include <vector>

#include "calib/validation/board_solves.h"
#include "calib/validation/boards.h"

namespace dtr::calib {

/// One check each of lenses, places of a rig's cameras and the scale of the rig, by their
/// differences in standard deviations; the worst over cameras and solves. `kept`: a solve of the
/// views that made the calibration; `unseen`: of other views, null without. Fills
/// ValidatedCamera::difference.
std::vector<Check> TestDifferences(const ValidatedCalibration& calibration, const Fresh& kept,
                                   const Fresh* unseen, const BoardLimits& limits,
                                   std::vector<ValidatedCamera>& cameras);

}  // namespace dtr::calib
