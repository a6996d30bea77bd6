// Cameras without a common clock in full: several draws, gaps, and clocks that keep no rate.
#include "calib/judge/free_running.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/judge/patterns.h"
#include "dtr/base/error.h"
#include "tests/calib/judge/late_views.h"

namespace dtr::calib {
namespace {

using namespace testing;

double SquaredDistance(const RigSolution& solution, const std::vector<RigCamera>& truth) {
  const Eigen::VectorXd error = Difference(solution.layout, truth, solution.rig.cameras);
  return error.dot(solution.covariance.inverse() * error);
}

TEST(FreeRunningFull, DelaysAreFoundWithinTheirSigmasAndTheRigWithThem) {
  const auto cameras = RowOfCameras(3, 0.05);
  constexpr int kSolves = 3;
  double squares = 0, rig = 0;
  for (int k = 0; k < kSolves; ++k) {
    const auto views = LateViews(cameras, kDelays, 20 + static_cast<std::uint64_t>(k));
    const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
    for (size_t c = 1; c < cameras.size(); ++c) {
      ASSERT_TRUE(free.delays[c]);
      EXPECT_TRUE(free.moved[c]);
      const double off = (free.delays[c]->frames - kDelays[c]) / free.delays[c]->sigma;
      EXPECT_LT(std::abs(off), 3) << "camera " << c << ", draw " << k << ": "
                                  << free.delays[c]->frames << " +- " << free.delays[c]->sigma;
      EXPECT_LT(free.delays[c]->sigma, 1e-3);
      squares += off * off / (2 * kSolves);
    }
    EXPECT_NEAR(free.solution.sigma_px, kNoisePx, 0.03 * kNoisePx);
    // Interpolating between frames leaves a trace, far below what is called unsteady (0.05 px).
    EXPECT_LT(TestUnsteadyClocks(free.solution).amplitude_px, 0.02);
    rig += SquaredDistance(free.solution, cameras) /
           (kSolves * static_cast<double>(free.solution.layout.size()));
    EXPECT_EQ(free.delays[0]->frames, 0);
  }
  // Chi-squared of 6 draws over 6 has sigma 0.58; of the rig's 3 x 36 unknowns 0.14.
  EXPECT_LT(squares, 1 + 3 * 0.58);
  EXPECT_GT(squares, 0.05);
  EXPECT_NEAR(rig, 1, 0.5);
}

TEST(FreeRunningFull, SolvedAsIfSynchronisedTheRigIsFarOff) {
  const auto cameras = RowOfCameras(3, 0.05);
  const auto views = LateViews(cameras, kDelays, 20);
  // Lenses bend to make up for the delays: so far that one is rejected, or not enough.
  try {
    EXPECT_GT(SolveRig(kBoard, InputsOf(cameras), views, kFrames).rms_px, 5 * kNoisePx);
  } catch (const Error& rejection) {
    EXPECT_THAT(rejection.what(), ::testing::HasSubstr("folds back before the corner"));
  }
  const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
  // What validate makes of the corners that are kept: nothing of the delays is left in them.
  const PatternTest left = TestTimeOffset(free.solution);
  for (size_t c = 0; c < left.coefficients.size(); ++c) {
    EXPECT_LT(std::abs(left.coefficients[c]), 4.5 * left.sigmas[c]);
  }
}

TEST(FreeRunningFull, MomentsThatNoFrameIsNearAreLeftOutByName) {
  const auto cameras = RowOfCameras(2, 0.1);
  auto views = LateViews(cameras, {0, 0.5}, 5);
  // A gap of 4 frames, and the last frame: nothing follows them.
  std::erase_if(views, [](const RigView& view) { return view.frame >= 20 && view.frame < 24; });
  const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
  std::vector<std::string> names;
  for (const LeftOut& item : free.solution.left_out) names.push_back(item.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("cam1/19", "cam1/29"));
  EXPECT_LT(std::abs(free.delays[1]->frames - 0.5), 3.5 * free.delays[1]->sigma);
}

// Webcams: every image a little before or after its time, which moves corners by far more than
// they err. Which of them are outliers changes with the delays, and the delays with them.
TEST(FreeRunningFull, PicturesThatDoNotKeepTimeSettleToo) {
  constexpr double kJitter = 0.1;
  const auto cameras = RowOfCameras(3, 0.05);
  const auto views = LateViews(cameras, {0, -0.6, 0.2}, 32, kJitter);
  const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
  EXPECT_GT(free.passes, 5);  // else nothing has been decided on
  // A mean of 30 moments of either camera, one in a hundred thousand beyond 4.5 sigmas.
  const double limit = 4.5 * kJitter * std::sqrt(2.0 / kFrames);
  EXPECT_NEAR(free.delays[1]->frames, -0.6, limit);
  EXPECT_NEAR(free.delays[2]->frames, 0.2, limit);
  // That there is no one delay is seen.
  const PatternTest unsteady = TestUnsteadyClocks(free.solution);
  EXPECT_LT(unsteady.p, 1e-12);
  EXPECT_GT(unsteady.amplitude_px, 0.05);
  // Every corner is there, and either counts or is named.
  size_t corners = 0, outliers = 0;
  for (const RigView& view : free.solution.rig.views) {
    corners += view.seen.corners.size();
    outliers += view.outliers.size();
    for (const int id : view.outliers) {
      EXPECT_TRUE(std::any_of(view.seen.corners.begin(), view.seen.corners.end(),
                              [&](const BoardCorner& corner) { return corner.id == id; }));
    }
  }
  EXPECT_EQ(corners + static_cast<size_t>(kBoard.CornerCount()) * free.solution.left_out.size(),
            views.size() * static_cast<size_t>(kBoard.CornerCount()));
  EXPECT_EQ(outliers, static_cast<size_t>(free.solution.outliers));
  EXPECT_EQ(corners - outliers, static_cast<size_t>(free.solution.corners));
  // Rows speak of corners that count, where they are.
  for (const FrameRows& frame : free.solution.rows) {
    for (const RowOrigin& origin : frame.origins) {
      const RigView& view = free.solution.rig.views[origin.view];
      EXPECT_FALSE(Holds(view.outliers, view.seen.corners[origin.corner].id));
    }
  }
}

// What validate then makes of the kept corners: it takes the board's speed at the frames' own
// moments, the solve at the delayed ones, and where every image has a delay of its own the two
// weigh these otherwise. That breaks the test of delays, by less than the images' own scatter.
TEST(FreeRunningFull, PicturesThatDoNotKeepTimeLeaveARestOfTheDelay) {
  const auto cameras = RowOfCameras(2, 0.05);
  const auto views = LateViews(cameras, {0, -0.6}, 6, 0.1);
  const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
  const PatternTest left = TestTimeOffset(free.solution);
  ASSERT_EQ(left.coefficients.size(), 1u);
  EXPECT_GT(std::abs(left.coefficients[0]), kDelaySigmas * left.sigmas[0]);  // 7.7 of them
  EXPECT_LT(std::abs(left.coefficients[0]), 0.1);                            // 0.022
}

}  // namespace
}  // namespace dtr::calib
