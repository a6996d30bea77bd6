#include "calib/motion_clocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"

namespace dtr::calib {
namespace {

using dtr::testing::LookAt;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kColumns = 32, kRows = 22;

// Where things are at a time, frames.
using Things = std::vector<Eigen::Vector3d> (*)(double time);

std::vector<Eigen::Vector3d> Wandering(double time) {
  std::vector<Eigen::Vector3d> things;
  for (int i = 0; i < 3; ++i) {
    const double a = 0.31 + 0.07 * i, b = 0.19 + 0.05 * i;
    things.emplace_back(0.8 * std::sin(a * time + i) + 0.3 * std::sin(1.7 * b * time),
                        0.6 * std::cos(b * time + 2.0 * i) + 0.2 * std::sin(2.3 * a * time),
                        0.5 * std::sin(0.7 * a * time + 1.3 * b * time + i));
  }
  return things;
}

std::vector<Eigen::Vector3d> Still(double) { return {{0.2, 0.1, 0}}; }

std::vector<Eigen::Vector3d> Turning(double time) {
  const double turn = 2 * M_PI * time / 8;
  return {{0.8 * std::cos(turn), 0.6 * std::sin(turn), 0.2 * std::sin(turn)}};
}

// A camera to the right of the first by `angle` (rad), whose frame t shows time t - later.
MotionSeen Camera(const std::string& name, double angle, double later, int frames, Things things) {
  MotionSeen seen{name, {CameraModel::kPinhole, 640, 440, {500, 500, 320, 220}}, {}, {}};
  seen.cam_from_world =
      LookAt({4 * std::sin(angle), 0.3 * std::sin(3 * angle), -4 * std::cos(angle)}, {0, 0, 0});
  seen.cells.resize(1);
  for (int t = 1; t < frames; ++t) {
    Grid<float> cells(kColumns, kRows);
    const auto before = things(t - 1 - later), now = things(t - later);
    for (size_t i = 0; i < now.size(); ++i) {
      const auto pixel =
          *seen.lens.PixelFromCam(seen.cam_from_world * (0.5 * (before[i] + now[i])));
      const double moved = (now[i] - before[i]).norm();
      for (int y = 0; y < kRows; ++y) {
        for (int x = 0; x < kColumns; ++x) {
          const Eigen::Vector2d off((x + 0.5) * 20 - pixel.x(), (y + 0.5) * 20 - pixel.y());
          cells(x, y) += static_cast<float>(moved * std::exp(-off.squaredNorm() / (2 * 30 * 30)));
        }
      }
    }
    seen.cells.push_back(std::move(cells));
  }
  return seen;
}

std::string RejectionOf(const std::vector<MotionSeen>& cameras) {
  try {
    FindMotionClocks(cameras);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

// Motion that is exact: 0.013 frames off at most, 0.021 with frames missing, and 0.041 by its own
// account. Bounds are some twice that.
TEST(MotionClocks, AreFoundToAFractionOfAFrame) {
  const double later[] = {0, 2.4, -3, 0.7, 11};
  std::vector<MotionSeen> cameras;
  for (int c = 0; c < 5; ++c) {
    cameras.push_back(Camera("cam" + std::to_string(c), 0.3 * c, later[c], 60, Wandering));
  }
  const std::vector<MotionClock> clocks = FindMotionClocks(cameras);
  ASSERT_EQ(clocks.size(), 5u);
  EXPECT_EQ(clocks[0].later, 0);
  for (size_t c = 0; c < 5; ++c) {
    EXPECT_NEAR(clocks[c].later, later[c], 0.05) << c;
    EXPECT_LT(clocks[c].rms_frames, 0.1) << c;
    EXPECT_GE(clocks[c].pairs, 3) << c;
  }
}

TEST(MotionClocks, LongerRecordingsAndMissingFramesDoNotMatter) {
  std::vector<MotionSeen> cameras{Camera("a", 0, 0, 50, Wandering),
                                  Camera("b", 0.5, 5, 70, Wandering)};
  for (const size_t lost : {9, 10, 23, 24, 40}) cameras[1].cells[lost] = {};
  EXPECT_NEAR(FindMotionClocks(cameras)[1].later, 5, 0.05);
}

TEST(MotionClocks, ACameraWithoutMotionIsNamed) {
  const std::vector<MotionSeen> cameras{Camera("a", 0, 0, 40, Wandering),
                                        Camera("b", 0.4, 2, 40, Wandering),
                                        Camera("c", 0.8, 1, 40, Still)};
  EXPECT_THAT(RejectionOf(cameras), AllOf(HasSubstr("camera c"), HasSubstr("timestamps.csv")));
}

TEST(MotionClocks, TheFirstCameraWithoutMotionIsNamedToo) {
  const std::vector<MotionSeen> cameras{Camera("a", 0, 0, 40, Still),
                                        Camera("b", 0.4, 2, 40, Wandering),
                                        Camera("c", 0.8, 1, 40, Wandering)};
  EXPECT_THAT(RejectionOf(cameras), HasSubstr("camera a"));
}

TEST(MotionClocks, MotionThatRepeatsDecidesNothing) {
  const std::vector<MotionSeen> cameras{Camera("a", 0, 0, 64, Turning),
                                        Camera("b", 0.4, 3, 64, Turning)};
  EXPECT_THAT(RejectionOf(cameras), HasSubstr("camera b: expected motion"));
}

}  // namespace
}  // namespace dtr::calib
