#include "calib/boards/repeats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace dtr::calib {

double MeanDistancePx(const BoardView& view, const BoardView& earlier) {
  double sum = 0;
  auto other = earlier.corners.begin();
  for (const BoardCorner& corner : view.corners) {
    while (other != earlier.corners.end() && other->id < corner.id) ++other;
    if (other == earlier.corners.end() || other->id != corner.id) return HUGE_VAL;
    sum += (corner.pixel - other->pixel).norm();
  }
  return sum / static_cast<double>(std::max<size_t>(1, view.corners.size()));
}

double NearestViewsPx(int width_px, int height_px) {
  return 0.002 * std::hypot(width_px, height_px);
}

std::vector<LeftOut> TakeOutRepeats(double nearest_px, std::vector<BoardView>& views) {
  std::vector<BoardView> kept;
  std::vector<LeftOut> left_out;
  for (BoardView& view : views) {
    const auto repeated = std::find_if(kept.begin(), kept.end(), [&](const BoardView& earlier) {
      return MeanDistancePx(view, earlier) < nearest_px;
    });
    if (repeated == kept.end()) {
      kept.push_back(std::move(view));
    } else {
      left_out.push_back({view.name, fmt::format("adds nothing: the board is within {:.2f} px of "
                                                 "where {} shows it",
                                                 nearest_px, repeated->name)});
    }
  }
  views = std::move(kept);
  return left_out;
}

}  // namespace dtr::calib
