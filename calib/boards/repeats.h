// calib/boards/repeats.h -- images that add nothing are left out, by name.
#pragma once
#include <vector>

#include "calib/boards/observations.h"

namespace dtr::calib {

/// Mean distance of the corners of `view` to the same ones of `earlier`, px; infinite where one is
/// missing there.
double MeanDistancePx(const BoardView& view, const BoardView& earlier);

/// Takes out of `views` each one that shows the board where an earlier one (in the order given)
/// showed it: it sees no corner that the earlier one does not, and the corners lie on average less
/// than `nearest_px` away. Errors of such views are the same errors again (of the print, the pixel
/// grid, the compression), so counting them twice makes a calibration look surer, not better.
/// Returns what was taken out, with the name of the view that it repeats.
std::vector<LeftOut> TakeOutRepeats(double nearest_px, std::vector<BoardView>& views);

/// Default of `nearest_px`: 0.2 % of the image's diagonal, 1.6 px of 640 x 480.
double NearestViewsPx(int width_px, int height_px);

}  // namespace dtr::calib
