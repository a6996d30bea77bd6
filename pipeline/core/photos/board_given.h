// pipeline/core/photos/board_given.h -- ends early where photos show another board than the one
// given.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "calib/boards/board.h"
#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// Looks at up to 8 images spread evenly over `count`, before minutes go into all of them, until
/// one shows the given board or enough agree on another. `load` reads one, from several threads at
/// once; those it throws Error for are passed over. Throws UsageError that starts with `where` when
/// they show another board (calib::DescribeOtherBoard).
void RequireGivenBoard(const std::string& where, const calib::Board& board, std::size_t count,
                       const std::function<ImageRgb8(std::size_t)>& load);

}  // namespace dtr::pipeline
