// The PatchMatch engine on images of full size.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>

#include "datasets/exact/stereo_score.h"

namespace dtr::stereo {
namespace {

using testing::Facing;

std::int64_t PeakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{1024} * usage.ru_maxrss;
}

TEST(PatchMatchFull, TwoPicturesOfTwelveMegapixels) {
  // 350 px of disparity in the middle; detail of 8 and 3 px, no rays wasted on finer ones.
  const PinholeCamera camera(4000, 3000, 3500, 3500, 2000, 1500);
  const auto paint = [](const testing::Vector3d& p, const testing::Vector3d&) {
    return 30 + 130 * testing::Noise(p / 0.009) + 65 * testing::Noise(p / 0.0035);
  };
  std::vector<testing::Shot> shots;
  for (const double x : {0.0, 0.4}) {
    shots.push_back(testing::Photograph(testing::Slanted(), camera, Facing({x, 0, 0}), paint));
  }
  const auto views = testing::ViewsOf(shots);
  const std::int64_t before = PeakBytes();
  const DepthEstimate estimate = testing::EstimateFirstBy("patchmatch", views, {2.5, 8});
  const double bytes_per_pixel = static_cast<double>(PeakBytes() - before) / 12e6;
  const testing::Score score = testing::ScoreFirst(views, estimate, shots[0].truth);
  EXPECT_GT(score.kept, 0.95);
  EXPECT_LT(score.median_px, 2 * testing::MatchingLimitPx(shots[0].image, {1, 0}, 1.0));
  EXPECT_LT(score.past_1px, 0.01);
  // What the engine's header states for one neighbour, and the estimate itself.
  EXPECT_LT(bytes_per_pixel, 100 + 18 + 8);
}

}  // namespace
}  // namespace dtr::stereo
