// pipeline/metres/detail/scale_board.h -- a calibration board that stands in the scene of a set.
#pragma once
#include <filesystem>
#include <vector>

#include "calib/boards/board.h"
#include "calib/solve/board_scale.h"
#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// The board in the images of a set, one view at a time per thread.
struct BoardInSet {
  std::vector<calib::BoardObservation> observations;
  std::vector<calib::LeftOut> without;  ///< views in which it was not found, and why
};

/// Looks for the board in the source views of the set's first frame: what is measured must not
/// depend on photos that are held out. Throws Error where it is in fewer than 3 of them.
BoardInSet FindBoard(const std::filesystem::path& folder, const DtrSet& set,
                     const calib::Board& board, Progress& progress);

}  // namespace dtr::pipeline
