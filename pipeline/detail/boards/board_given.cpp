#include "pipeline/detail/boards/board_given.h"

#include <algorithm>
#include <vector>

#include "calib/boards/board_check.h"
#include "calib/boards/detect.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::pipeline {
namespace {

constexpr std::size_t kImages = 8;

}  // namespace

void RequireGivenBoard(const std::string& where, const calib::Board& board, std::size_t count,
                       const std::function<ImageRgb8(std::size_t)>& load, int threads) {
  std::vector<calib::BoardCheck> checks(std::min(kImages, count));
  ParallelFor(0, static_cast<int>(checks.size()), threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    try {
      checks[at] = calib::CheckBoard(calib::GreyOf(load(at * count / checks.size())), board);
    } catch (const Error&) {
      // Is reported where every image is read.
    }
  });
  const std::string other = calib::DescribeOtherBoard(board, checks);
  if (!other.empty()) throw UsageError(where + ": " + other);
}

}  // namespace dtr::pipeline
