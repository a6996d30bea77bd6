// calib/bundle/one_position.h -- photos that were taken from one position: exposure brackets,
// bursts.
#pragma once
#include <string>
#include <vector>

#include "calib/sfm_model.h"

namespace dtr::calib {

/// Groups of images (indices, rising) from one position: cameras that see points in common, and
/// stand apart by less than 0.5 % of these points' median distance, each from each, with no other
/// image within 2 %.
std::vector<std::vector<int>> ImagesOfOnePosition(const SfmModel& model);

/// One line that names them; empty where there are none.
std::string OnePositionLine(const SfmModel& model);

}  // namespace dtr::calib
