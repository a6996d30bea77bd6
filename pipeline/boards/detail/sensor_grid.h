// pipeline/boards/detail/sensor_grid.h -- views of one camera on one grid, also of photos that were
// rotated.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "calib/lens_camera.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// A view in the pixels of its photo as stored, whose EXIF orientation does not matter.
struct StoredView {
  calib::BoardView view;
  int width_px = 0, height_px = 0;  ///< of the photo
};

struct ViewsOnGrid {
  int width_px = 0, height_px = 0;
  std::vector<calib::BoardView> views;   ///< in the order given
  std::vector<calib::LeftOut> left_out;  ///< of another size, or rotated and nobody knows which way
};

/// Brings one camera's views to the grid that most photos have: sizes count together with their
/// sides swapped, then the more frequent of the two is taken, of equally frequent ones landscape.
/// Photos with swapped sides are those that a program rotated: which way the residuals say
/// (calib/solve/rotated_views.h), against a camera solved from the others. One line, starting with
/// `name`, reports how many were put back and which way, another how many were not. A camera that
/// is `known` gives the grid, if any photo has its size or that with swapped sides, and is what
/// they are compared with.
ViewsOnGrid OnOneGrid(const calib::Board& board, std::vector<StoredView> stored,
                      const std::string& name, const std::optional<calib::LensCamera>& known,
                      Progress& progress);

}  // namespace dtr::pipeline
