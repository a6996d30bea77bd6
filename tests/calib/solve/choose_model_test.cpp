#include "calib/solve/choose_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "tests/calib/solve/synthetic_views.h"
#include "tests/support/on_threads.h"

namespace dtr::calib {
namespace {

using testing::ExactViews;
using testing::kBoard;
using testing::Noisy;
using testing::TypicalCamera;

ModelChoice Choose(const std::vector<BoardView>& views, int threads = 0) {
  ChoiceOptions options;
  options.folds = 5;
  const ThreadLimit limit(threads);
  return ChooseModel(kBoard, views, 640, 480, options);
}

const ModelScore& ScoreOf(const ModelChoice& choice, BoardModel model) {
  for (const ModelScore& score : choice.scores) {
    if (score.model == model) return score;
  }
  throw std::logic_error("no score");
}

TEST(ChooseModel, TakesTheCoefficientsThatTheLensHasAndNoMore) {
  for (const BoardModel model : {BoardModel::kPinhole, BoardModel::kBrown4, BoardModel::kFisheye}) {
    const auto views = Noisy(ExactViews(TypicalCamera(model), 12, 21).views, 0.1, 22);
    const ModelChoice choice = Choose(views);
    const ModelScore& chosen = choice.scores[choice.chosen];
    EXPECT_EQ(NameOf(chosen.model), NameOf(model));
    EXPECT_LE(chosen.low_px, 0);
    // Unseen views of the right model show the noise, and the little that training adds.
    EXPECT_NEAR(chosen.held_out_rms_px, 0.1 * std::sqrt(2.0), 0.1 * 0.1 * std::sqrt(2.0));
    if (model == BoardModel::kBrown4) {
      EXPECT_GT(ScoreOf(choice, BoardModel::kPinhole).low_px, 0);
    }
  }
}

TEST(ChooseModel, AThirdRadialCoefficientIsTakenWhereTheLensNeedsIt) {
  const LensCamera camera =
      CameraFrom(BoardModel::kBrown5, 640, 480,
                 std::vector<double>{430, 432, 322, 236, -0.30, 0.20, 1e-3, -5e-4, -0.10});
  const auto views = Noisy(ExactViews(camera, 25, 23).views, 0.05, 24);
  const ModelChoice choice = Choose(views);
  EXPECT_GT(ScoreOf(choice, BoardModel::kBrown4).low_px, 0);
  // Which of the others it is, noise decides: a fisheye's four radial coefficients may do as well.
  const ModelScore& chosen = choice.scores[choice.chosen];
  EXPECT_NE(NameOf(chosen.model), "brown4");
  EXPECT_LT(chosen.held_out_rms_px, ScoreOf(choice, BoardModel::kBrown4).held_out_rms_px);
  EXPECT_LE(chosen.low_px, 0);
}

// A webcam whose board is held up in the middle: nobody says what the lens does at the border.
TEST(ChooseModel, WhereCornersSayNothingALensIsNotBent) {
  const LensCamera camera =
      CameraFrom(BoardModel::kBrown5, 1280, 720,
                 std::vector<double>{651, 654, 647, 392, 0.18, -0.256, 0.0032, 0.0022, 0.124});
  std::vector<BoardView> views;
  for (const BoardView& view : Noisy(ExactViews(camera, 400, 31).views, 0.15, 32)) {
    const bool in_the_middle =
        std::all_of(view.corners.begin(), view.corners.end(), [](const BoardCorner& corner) {
          return (corner.pixel - Eigen::Vector2d(647, 392)).norm() < 300;
        });
    if (in_the_middle && views.size() < 20) views.push_back(view);
  }
  ASSERT_EQ(views.size(), 20u);
  ChoiceOptions options;
  options.folds = 5;
  const ModelChoice choice = ChooseModel(kBoard, views, 1280, 720, options);
  const BoardSolution& chosen = *choice.scores[choice.chosen].solution;
  EXPECT_NEAR(chosen.camera.params[0], 651, 0.03 * 651);
  for (const ModelScore& score : choice.scores) {
    if (!score.refused.empty() || score.model != BoardModel::kFisheye) continue;
    for (size_t i = 4; i < 8; ++i) EXPECT_LT(std::abs(score.solution->camera.params[i]), 1);
  }
}

TEST(ChooseModel, DoesNotDependOnThreads) {
  const auto views = Noisy(ExactViews(TypicalCamera(BoardModel::kBrown4), 8, 5).views, 0.1, 6);
  const ModelChoice one = Choose(views, 1), two = Choose(views, 2);
  EXPECT_EQ(one.chosen, two.chosen);
  for (size_t i = 0; i < one.scores.size(); ++i) {
    EXPECT_EQ(one.scores[i].held_out_rms_px, two.scores[i].held_out_rms_px);
    EXPECT_EQ(one.scores[i].low_px, two.scores[i].low_px);
  }
}

TEST(ChooseModel, FewViewsAreRejectedInOneLine) {
  const auto views = ExactViews(TypicalCamera(BoardModel::kPinhole), 4, 5).views;
  try {
    Choose(views);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("expected at least 5 images"));
  }
}

}  // namespace
}  // namespace dtr::calib
