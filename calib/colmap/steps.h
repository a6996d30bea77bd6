// calib/colmap/steps.h -- COLMAP for structure from motion.
#pragma once
#include "calib/sfm/run/colmap_steps.h"

namespace dtr::colmap {

/// By the `colmap` on the PATH.
const sfm::ColmapSteps& Steps();

}  // namespace dtr::colmap
