#include "calib/solve/board_solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/base/error.h"
#include "tests/calib/solve/synthetic_views.h"

namespace dtr::calib {
namespace {

using testing::ExactViews;
using testing::kBoard;
using testing::Noisy;
using testing::TypicalCamera;

// Exact corners give the camera back; what is left is the solver's last step.
constexpr double kExactPx = 1e-5;
constexpr int kViews = 15;

BoardSolution Solve(const std::vector<BoardView>& views, BoardModel model,
                    const SolveOptions& options = {}) {
  return SolveBoard(kBoard, views, 640, 480, model, options);
}

// Largest distance between where the two cameras draw the rays of the first one's pixels.
double LargestDifferencePx(const LensCamera& a, const LensCamera& b) {
  const LensMap first(a), second(b);
  double largest = 0;
  for (double x = 0; x <= 640; x += 40) {
    for (double y = 0; y <= 480; y += 40) {
      const auto ray = first.RayFromPixel({x, y});
      if (!ray) continue;  // outside of a fisheye's circle
      const auto pixel = second.PixelFromCam(*ray);
      largest = std::max(largest, pixel ? (*pixel - Eigen::Vector2d(x, y)).norm() : HUGE_VAL);
    }
  }
  return largest;
}

void ExpectRejected(const std::vector<BoardView>& views, BoardModel model, const char* words) {
  try {
    Solve(views, model);
    FAIL() << "not rejected: " << words;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr(words));
  }
}

TEST(BoardSolve, ExactCornersGiveTheCameraBackForEveryModel) {
  for (const BoardModel model : kBoardModels) {
    const LensCamera truth = TypicalCamera(model);
    const auto exact = ExactViews(truth, kViews, 3);
    const BoardSolution solution = Solve(exact.views, model);
    EXPECT_LT(LargestDifferencePx(truth, solution.camera), kExactPx) << NameOf(model);
    EXPECT_LT(solution.rms_px, kExactPx) << NameOf(model);
    EXPECT_EQ(solution.outliers, 0) << NameOf(model);
    EXPECT_TRUE(solution.left_out.empty());
  }
}

TEST(BoardSolve, OutliersAreNamedAndDoNotMoveTheCamera) {
  const LensCamera truth = TypicalCamera(BoardModel::kBrown4);
  auto views = Noisy(ExactViews(truth, kViews, 5).views, 0.1, 6);
  const BoardSolution clean = Solve(views, BoardModel::kBrown4);
  views[2].corners[7].pixel += Eigen::Vector2d(3, -2);
  views[4].corners[50].pixel += Eigen::Vector2d(1e6, 0);
  const BoardSolution solution = Solve(views, BoardModel::kBrown4);
  EXPECT_EQ(solution.views[2].outliers, std::vector<int>{7});
  EXPECT_EQ(solution.views[4].outliers, std::vector<int>{50});
  EXPECT_EQ(solution.outliers, 2);
  // Two corners of 810 less.
  EXPECT_LT(LargestDifferencePx(clean.camera, solution.camera), 0.1);
  EXPECT_NEAR(solution.sigma_px, clean.sigma_px, 0.02 * clean.sigma_px);
}

TEST(BoardSolve, HalfOfTheCornersMayBeWrong) {
  const LensCamera truth = TypicalCamera(BoardModel::kBrown4);
  auto views = Noisy(ExactViews(truth, 20, 8).views, 0.1, 9);
  Random random(10);
  std::vector<BoardView> right;
  for (BoardView& view : views) {
    right.push_back({view.name, {}, 0});
    for (BoardCorner& corner : view.corners) {
      if (random.Uniform() < 0.5) {
        corner.pixel += Eigen::Vector2d(random.Uniform(-60, 60), random.Uniform(-60, 60));
      } else {
        right.back().corners.push_back(corner);
      }
    }
  }
  const BoardSolution solution = Solve(views, BoardModel::kBrown4);
  const BoardSolution clean = Solve(right, BoardModel::kBrown4);
  // A wrong corner lands within 5 sigma of the right place once in 5000.
  EXPECT_NEAR(solution.corners, clean.corners, 2);
  EXPECT_LT(LargestDifferencePx(clean.camera, solution.camera), 0.2);
  EXPECT_NEAR(solution.sigma_px, clean.sigma_px, 0.03 * clean.sigma_px);
}

TEST(BoardSolve, AViewOfNoBoardIsLeftOutAndNamed) {
  auto views = Noisy(ExactViews(TypicalCamera(BoardModel::kPinhole), kViews, 5).views, 0.1, 6);
  Random random(1);
  for (BoardCorner& corner : views[3].corners) {
    corner.pixel = {random.Uniform(0, 640), random.Uniform(0, 480)};
  }
  const BoardSolution solution = Solve(views, BoardModel::kPinhole);
  ASSERT_EQ(solution.left_out.size(), 1u);
  EXPECT_EQ(solution.left_out[0].name, "view3");
  EXPECT_EQ(solution.views.size(), static_cast<size_t>(kViews - 1));
}

TEST(BoardSolve, PartlySeenBoardsCount) {
  const LensCamera truth = TypicalCamera(BoardModel::kBrown4);
  auto views = Noisy(ExactViews(truth, 20, 5).views, 0.1, 6);
  for (size_t i = 0; i < views.size(); i += 2) {
    auto& corners = views[i].corners;  // the lower half of every other board is hidden
    corners.resize(corners.size() / 2);
  }
  const BoardSolution solution = Solve(views, BoardModel::kBrown4);
  EXPECT_EQ(solution.corners + solution.outliers, 10 * 54 + 10 * 27);
  EXPECT_NEAR(solution.sigma_px, 0.1, 0.01);
}

TEST(BoardSolve, TheUnitOfTheBoardChangesNothingButDistances) {
  const auto views = Noisy(ExactViews(TypicalCamera(BoardModel::kBrown5), kViews, 5).views, 0.1, 6);
  const BoardSolution solution = Solve(views, BoardModel::kBrown5);
  for (const double scale : {1e-6, 1e6}) {
    Board scaled = kBoard;
    scaled.square *= scale;
    const BoardSolution other = SolveBoard(scaled, views, 640, 480, BoardModel::kBrown5);
    EXPECT_LT(LargestDifferencePx(solution.camera, other.camera), 1e-6);
    EXPECT_NEAR(other.views[0].cam_from_board.translation.norm() /
                    solution.views[0].cam_from_board.translation.norm() / scale,
                1, 1e-8);
  }
}

TEST(BoardSolve, TelephotoAndFisheyeOf190Degrees) {
  const LensCamera tele = CameraFrom(BoardModel::kPinhole, 640, 480,
                                     std::vector<double>{18335, 18335, 322, 236});  // 2 degrees
  const auto tele_views = ExactViews(tele, 30, 2, 60);
  const BoardSolution narrow = Solve(tele_views.views, BoardModel::kPinhole);
  EXPECT_NEAR(narrow.camera.params[0], 18335, 1);
  const LensCamera wide = CameraFrom(BoardModel::kFisheye, 640, 480,
                                     std::vector<double>{121, 121, 320, 240, 0, 0, 0, 0});
  // 640 px / 2 / 121 px = 151 degrees to the sides; 190 degrees lie 200 px from the middle.
  const auto wide_views = ExactViews(wide, 30, 2);
  const BoardSolution fisheye = Solve(wide_views.views, BoardModel::kFisheye);
  EXPECT_LT(LargestDifferencePx(wide, fisheye.camera), 1e-3);
}

TEST(BoardSolve, DegenerateViewsAreNamedNotSolved) {
  const LensCamera camera = TypicalCamera(BoardModel::kPinhole);
  // Fronto-parallel: the camera looks straight at every board.
  std::vector<BoardView> parallel;
  for (int i = 0; i < 12; ++i) {
    Pose pose;
    pose.translation = Eigen::Vector3d(0.01 * i - 0.1, 0.005 * i, 0.4 + 0.03 * i);
    BoardView view{"view" + std::to_string(i), {}, 0};
    for (int id = 0; id < kBoard.CornerCount(); ++id) {
      view.corners.push_back({id, *camera.PixelFromCam(pose * kBoard.Corner(id))});
    }
    parallel.push_back(std::move(view));
  }
  ExpectRejected(Noisy(parallel, 0.1, 1), BoardModel::kPinhole,
                 "the focal length is not determined");
  const auto views = Noisy(ExactViews(camera, 12, 4).views, 0.1, 1);
  ExpectRejected({views[0], views[1]}, BoardModel::kPinhole, "at least 3 images");
  // The same board three times under other names.
  ExpectRejected({views[0], views[0], views[0]}, BoardModel::kPinhole, "parallel boards");
}

TEST(BoardSolve, ADistortionThatTurnsBackInsideTheImageIsRejected) {
  // Boards in the middle third only: six radial coefficients fit noise, not the lens.
  const LensCamera camera = TypicalCamera(BoardModel::kBrown4);
  int refused = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    auto all = ExactViews(camera, 40, seed).views;
    std::vector<BoardView> central;
    for (BoardView& view : all) {
      double farthest = 0;
      for (const auto& c : view.corners) {
        farthest = std::max(farthest, (c.pixel - Eigen::Vector2d(320, 240)).norm());
      }
      if (farthest < 200) central.push_back(std::move(view));
    }
    try {
      const auto solution =
          SolveBoard(kBoard, Noisy(central, 0.3, seed), 640, 480, BoardModel::kBrown8);
      EXPECT_TRUE(CoversImage(solution.camera));
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(BoardSolve, TheSameInputGivesTheSameBits) {
  const auto views = Noisy(ExactViews(TypicalCamera(BoardModel::kBrown8), kViews, 5).views, 0.1, 6);
  EXPECT_EQ(Solve(views, BoardModel::kBrown8).camera.params,
            Solve(views, BoardModel::kBrown8).camera.params);
}

}  // namespace
}  // namespace dtr::calib
