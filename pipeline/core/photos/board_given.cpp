#include "pipeline/core/photos/board_given.h"

#include <algorithm>
#include <array>
#include <vector>

#include "calib/boards/board_check.h"
#include "calib/boards/detect.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/types/area_average.h"

namespace dtr::pipeline {
namespace {

// Of eight images that are spread evenly, two at a time, far from each other first.
constexpr std::array<std::size_t, 8> kOrder{0, 4, 2, 6, 1, 5, 3, 7};
constexpr std::size_t kAtOnce = 2;
// So many that show one other board, and none the given one, are enough.
constexpr std::ptrdiff_t kSure = 3;
// Looking for boards of any size takes time by the pixel, and a photo that is filled by a board
// shows it at this long side, too.
constexpr int kLongSidePx = 1600;

calib::BoardCheck LookForBoard(const ImageRgb8& image, const calib::Board& board) {
  const Grid<std::uint8_t> grey = calib::GreyOf(image);
  const auto [width, height] = TargetSize(grey.width(), grey.height(), kLongSidePx);
  if (width == grey.width()) return calib::CheckBoard(grey, board);
  return calib::CheckBoard(AreaAverage(grey, width, height), board);
}

}  // namespace

void RequireGivenBoard(const std::string& where, const calib::Board& board, std::size_t count,
                       const std::function<ImageRgb8(std::size_t)>& load) {
  const std::size_t images = std::min(kOrder.size(), count);
  std::vector<calib::BoardCheck> checks;
  for (std::size_t begin = 0; begin < kOrder.size(); begin += kAtOnce) {
    std::array<calib::BoardCheck, kAtOnce> next;
    std::array<bool, kAtOnce> looked{};
    ParallelFor(0, static_cast<int>(kAtOnce), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      const std::size_t image = kOrder[begin + at];
      if (image >= images) return;
      looked[at] = true;
      try {
        next[at] = LookForBoard(load(image * count / images), board);
      } catch (const Error&) {
        // Is reported where every image is read.
      }
    });
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      if (looked[i]) checks.push_back(next[i]);
    }
    if (std::any_of(checks.begin(), checks.end(), [](const auto& c) { return c.shows_given; })) {
      return;
    }
    const auto others = std::count_if(checks.begin(), checks.end(),
                                      [](const auto& c) { return c.other.columns > 0; });
    const bool sure = others >= kSure || checks.size() == images;
    const std::string other = sure ? calib::DescribeOtherBoard(board, checks) : std::string();
    if (!other.empty()) throw UsageError(where + ": " + other);
  }
}

}  // namespace dtr::pipeline
