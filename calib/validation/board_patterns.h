// calib/validation/board_patterns.h -- internal to calib/validation: residuals that follow a
// pattern, held against the limits.
#pragma once
#include <vector>

#include "calib/validation/board_solves.h"

namespace dtr::calib {

/// Lens, board, rolling shutter and, of rigs, clocks: each pattern of calib/validation/patterns.h
/// in the residuals of this solve. A pattern that is likely by chance counts as 0 px.
std::vector<Check> PatternChecks(const Board& board, const Fresh& fresh, const BoardLimits& limits);

}  // namespace dtr::calib
