#include "calib/solve/board_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "calib/solve/rig_start.h"
#include "dtr/base/error.h"
#include "tests/calib/bundle/noise_sweep.h"
#include "tests/calib/solve/synthetic_views.h"

namespace dtr::calib {
namespace {

using namespace testing;
using ::testing::HasSubstr;

constexpr double kUnit = 0.4;  // units of the board per unit of the scene
constexpr double kNoisePx = 0.1;

// The board in a scene whose unit is kUnit, far from its origin, as `count` cameras see it.
std::vector<BoardObservation> BoardObservations(int count, std::uint64_t seed, double noise_px) {
  const LensCamera lens = TypicalCamera(BoardModel::kPinhole);
  const SyntheticViews truth = ExactViews(lens, count, seed);
  Similarity scene_from_board;
  scene_from_board.scale = 1 / kUnit;
  scene_from_board.rotation = Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 3).normalized());
  scene_from_board.translation = {50, -20, 7};
  Random random(HashOf(seed, 1));
  std::vector<BoardObservation> observations;
  for (size_t i = 0; i < truth.views.size(); ++i) {
    BoardObservation observation{lens.Pinhole(), scene_from_board.CamFromB(truth.cam_from_board[i]),
                                 truth.views[i]};
    for (BoardCorner& corner : observation.seen.corners) {
      corner.pixel += noise_px * Eigen::Vector2d(random.Normal(), random.Normal());
    }
    observations.push_back(std::move(observation));
  }
  return observations;
}

// The board lies elsewhere in this view.
void MoveBoard(BoardObservation& observation, double x_px) {
  for (BoardCorner& corner : observation.seen.corners) corner.pixel.x() += x_px;
}

void ExpectRejected(const std::vector<BoardObservation>& observations, const std::string& text) {
  try {
    ScaleFromBoard(kBoard, observations);
    FAIL() << "not rejected";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(text));
  }
}

TEST(BoardScale, ExactCornersGiveTheScaleWhicheverEndTheyAreCountedFrom) {
  auto observations = BoardObservations(6, 5, 0);
  for (const size_t turned : {1u, 4u}) {
    observations[turned].seen = TurnedByHalf(kBoard, observations[turned].seen);
  }
  const BoardScale scale = ScaleFromBoard(kBoard, observations);
  EXPECT_NEAR(scale.scene_from_board.scale * kUnit, 1, 1e-9);
  EXPECT_LT(scale.rms_px, 1e-6);
  EXPECT_EQ(scale.views.size(), 6u);
  EXPECT_EQ(scale.outliers, 0);
}

TEST(BoardScale, PredictedUncertaintyIsWhatNoiseDoes) {
  double squares = 0;
  constexpr int kSolves = 60;
  for (int k = 0; k < kSolves; ++k) {
    const BoardScale scale =
        ScaleFromBoard(kBoard, BoardObservations(8, 100 + static_cast<std::uint64_t>(k), kNoisePx));
    const double off = std::log(scale.scene_from_board.scale * kUnit) / scale.relative_sigma;
    EXPECT_LT(std::abs(off), 4.5) << k;
    squares += off * off / kSolves;
  }
  // The larger of two estimates of sigma is taken, so the mean is below 1; the jackknife's sigma
  // scatters by a fourth with 8 views.
  EXPECT_GT(squares, 0.4);
  EXPECT_LT(squares, 1.25);
}

TEST(BoardScale, ViewsOfABoardThatLayElsewhereAreNamedAndDoNoHarm) {
  auto observations = BoardObservations(8, 9, kNoisePx);
  MoveBoard(observations[0], 12);
  MoveBoard(observations[5], -30);
  observations[3].seen.corners[10].pixel.y() += 400;
  const BoardScale scale = ScaleFromBoard(kBoard, observations);
  EXPECT_LT(std::abs(std::log(scale.scene_from_board.scale * kUnit)), 4 * scale.relative_sigma);
  ASSERT_EQ(scale.left_out.size(), 2u);
  EXPECT_EQ(scale.left_out[0].name, "view0");
  EXPECT_EQ(scale.left_out[1].name, "view5");
  EXPECT_EQ(scale.outliers, 1);
}

TEST(BoardScale, CamerasThatErrMakeTheScaleLessCertain) {
  auto observations = BoardObservations(8, 9, kNoisePx);
  const double honest = ScaleFromBoard(kBoard, observations).relative_sigma;
  // Every camera looks aside a little: corners of a view err together, which no noise does.
  for (size_t i = 0; i < observations.size(); ++i)
    MoveBoard(observations[i], i % 2 == 0 ? 0.5 : -0.5);
  EXPECT_GT(ScaleFromBoard(kBoard, observations).relative_sigma, 2 * honest);
}

// Beyond 1.5 px corners that a set's own gate would not allow are outliers, noise or not.
TEST(BoardScale, HonestViewsAgreeAndAMovedBoardIsFoundAtEveryNoise) {
  for (const double noise_px : dtr::testing::kNoisesPx) {
    auto observations = BoardObservations(8, 9, noise_px);
    const BoardScale scale = ScaleFromBoard(kBoard, observations);
    EXPECT_TRUE(scale.left_out.empty()) << noise_px;
    EXPECT_LE(scale.outliers, noise_px <= 1 ? 0 : 0.1 * scale.corners) << noise_px;
    EXPECT_GT(scale.relative_sigma, 0) << noise_px;
    EXPECT_LT(std::abs(std::log(scale.scene_from_board.scale * kUnit)), 4 * scale.relative_sigma)
        << noise_px;
    MoveBoard(observations[2], 12 + 5 * noise_px);
    const BoardScale moved = ScaleFromBoard(kBoard, observations);
    ASSERT_EQ(moved.left_out.size(), 1u) << noise_px;
    EXPECT_EQ(moved.left_out[0].name, "view2");
  }
}

// A model's file rounds its poses, and corners may be exact all the same: none is an outlier.
TEST(BoardScale, SomePosesMayBeRounded) {
  for (const double rounding : {1e-9, 1e-7, 1e-5}) {
    auto observations = BoardObservations(8, 9, 0);
    for (size_t i = 0; i < 4; ++i) {
      observations[i].cam_from_world.translation += rounding * Eigen::Vector3d(1, -1, 1);
    }
    const BoardScale scale = ScaleFromBoard(kBoard, observations);
    EXPECT_TRUE(scale.left_out.empty()) << rounding;
    EXPECT_EQ(scale.outliers, 0) << rounding;
  }
}

TEST(BoardScale, WhatSaysNothingIsRejected) {
  ExpectRejected(BoardObservations(2, 5, 0),
                 "expected the board in 3 views or more, found it in 2");
  auto same = BoardObservations(4, 5, 0);
  for (BoardObservation& observation : same) observation = same.front();
  ExpectRejected(same, "expected two views that see the board under an angle of a degree or more");
  auto moved = BoardObservations(6, 5, kNoisePx);
  for (size_t i = 1; i < moved.size(); ++i) MoveBoard(moved[i], 17.0 * static_cast<double>(i * i));
  ExpectRejected(moved, "expected views that agree where the board lies");
}

}  // namespace
}  // namespace dtr::calib
