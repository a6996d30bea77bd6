// stereo/widen.h -- depth ranges that prove too narrow.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "stereo/geometric_passes.h"

namespace dtr::stereo {

/// A view on a smaller grid, for a look at it that costs little.
struct SmallView {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  StereoPixels pixels;
};
/// Long side at most `max_size_px`. The view has its pixels.
SmallView Shrink(const StereoView& view, int max_size_px);

/// Long side of the copies that Widened looks at, and how many neighbours a look asks at most.
int LookSide(const PinholeCamera& camera);
constexpr int kLookNeighbours = 4;

/// Share of the depths kept that lie at an end of their range.
struct EndShares {
  double at_near = 0, at_far = 0;
};
EndShares SharesAtEnds(const DepthImage& depth, const DepthRange& range);

/// The collection's ranges, widened where they prove too narrow: each view's depth is estimated at
/// 1/16 of its pixels or fewer, and where more than a hundredth of what is kept lies within 3 % of
/// an end, that end moves out (near / 1.5, far * 2), at most `most` times. What lies just beyond
/// the range is found at its end; the ends themselves stand away from the points they come from.
/// Says in one line how many ranges were widened, nothing when none was. Deterministic. Throws what
/// the engine throws, but takes NoUsablePair for an answer, and Interrupted.
std::vector<DepthRange> Widened(const Collection& collection, int most, Progress& progress);

}  // namespace dtr::stereo
