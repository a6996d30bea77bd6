#include "calib/solve/rig_solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>

#include "calib/boards/detect.h"
#include "calib/solve/rig_start.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "tests/calib/solve/synthetic_rig.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

using namespace testing;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr double kNoisePx = 0.1;

// Squared error of lenses and places over what is predicted, per unknown: 1 on average.
double NormalisedError(const RigSolution& solution, const std::vector<RigCamera>& truth) {
  const Eigen::VectorXd error = Difference(solution.layout, truth, solution.rig.cameras);
  return error.dot(solution.covariance.inverse() * error) / static_cast<double>(error.size());
}

TEST(RigSolve, ExactCornersGiveTheRigBack) {
  const auto cameras = RowOfCameras(3, 0.12);
  const Rig truth = ExactRig(cameras, 25, 4);
  const RigSolution solution = SolveRig(kBoard, InputsOf(cameras), truth.views, 25);
  EXPECT_LT(solution.rms_px, 1e-5);
  const auto error = Difference(solution.layout, cameras, solution.rig.cameras);
  for (size_t c = 1; c < 3; ++c) {
    EXPECT_LT(error.segment<6>(solution.layout.PlaceAt(c)).norm(), 1e-7);
  }
  EXPECT_EQ(solution.outliers, 0);
}

TEST(RigSolve, PredictedUncertaintyIsWhatNoiseDoes) {
  const auto cameras = RowOfCameras(2, 0.1);
  const Rig truth = ExactRig(cameras, 12, 7);
  double sum = 0, sigma = 0;
  constexpr int kSolves = 12;
  for (int k = 0; k < kSolves; ++k) {
    const auto solution = SolveRig(kBoard, InputsOf(cameras),
                                   NoisyViews(truth, kNoisePx, 100 + static_cast<unsigned>(k)), 12);
    sum += NormalisedError(solution, cameras) / kSolves;
    sigma += solution.sigma_px / kSolves;
  }
  // 12 times 22 unknowns: the mean of chi-squared over its expectation has sigma 0.087.
  EXPECT_NEAR(sum, 1, 0.35);
  EXPECT_NEAR(sigma, kNoisePx, 0.01 * kNoisePx);
}

TEST(RigSolve, BoardsCountedFromTheOtherEndAreFoundAndRepaired) {
  const auto cameras = RowOfCameras(2, 0.1);
  const Rig truth = ExactRig(cameras, 15, 3, false, 2);
  auto views = NoisyViews(truth, kNoisePx, 5);
  const auto right = SolveRig(kBoard, InputsOf(cameras), views, 15);
  std::vector<std::string> expected;
  for (RigView& view : views) {
    if (view.camera == 1 && view.frame % 3 == 1) {
      view.seen = TurnedByHalf(kBoard, view.seen);
      expected.push_back(view.seen.name);
    }
  }
  const auto repaired = SolveRig(kBoard, InputsOf(cameras), views, 15);
  EXPECT_THAT(repaired.flipped, ::testing::UnorderedElementsAreArray(expected));
  EXPECT_NEAR(repaired.rms_px, right.rms_px, 1e-7);
  EXPECT_LT(Difference(right.layout, right.rig.cameras, repaired.rig.cameras).norm(), 1e-4);
}

TEST(RigSolve, FittedFramesAreCountedFromOneEndToo) {
  const auto cameras = RowOfCameras(2, 0.1);
  const Rig truth = ExactRig(cameras, 15, 3, false, 2);
  auto views = NoisyViews(truth, kNoisePx, 5);
  std::vector<std::string> expected;
  for (RigView& view : views) {
    if (view.camera == 1 && view.frame % 3 == 1) {
      view.seen = TurnedByHalf(kBoard, view.seen);
      expected.push_back(view.seen.name);
    }
  }
  std::vector<LeftOut> left_out;
  std::vector<std::string> flipped;
  const Rig fitted = FitFrames(kBoard, cameras, views, 15, {}, left_out, &flipped);
  EXPECT_THAT(flipped, ::testing::UnorderedElementsAreArray(expected));
  double worst = 0;
  for (const auto& lengths : ResidualLengths(kBoard, fitted)) {
    for (const double length : lengths) worst = std::max(worst, length);
  }
  EXPECT_LT(worst, 6 * kNoisePx);  // of normal errors; a board from the other end misses by 100 px
}

TEST(RigSolve, ALensThatTurnsBackInsideTheImageIsRejectedByCamera) {
  auto cameras = RowOfCameras(2, 0.1);
  // Its image ends 288 px from the middle, where the corner is 400 px away.
  cameras[1].camera = CameraFrom(BoardModel::kBrown4, 640, 480,
                                 std::vector<double>{530, 532, 322, 236, -0.5, 0, 0, 0});
  const Rig truth = ExactRig(cameras, 15, 3, false, 2);
  auto inputs = InputsOf(cameras);
  for (size_t c = 0; c < 2; ++c) inputs[c].given = cameras[c].camera;
  RigOptions options;
  EXPECT_THAT([&] { SolveRig(kBoard, inputs, NoisyViews(truth, kNoisePx, 5), 15, options); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr(
                  "camera cam1: the distortion of the model brown4 folds back")));
  options.solve.cover_image = false;
  EXPECT_NO_THROW(SolveRig(kBoard, inputs, NoisyViews(truth, kNoisePx, 5), 15, options));
}

TEST(RigSolve, TwoCamerasInOnePointAreARig) {
  auto cameras = RowOfCameras(2, 0.0);
  cameras[1].cam_from_rig = {};
  const Rig truth = ExactRig(cameras, 15, 3, false, 2);
  const auto solution = SolveRig(kBoard, InputsOf(cameras), NoisyViews(truth, kNoisePx, 8), 15);
  EXPECT_LT(solution.rig.cameras[1].cam_from_rig.translation.norm(), 1e-3);
  EXPECT_LT(NormalisedError(solution, cameras), 2.5);
  EXPECT_NEAR(solution.sigma_px, kNoisePx, 0.05 * kNoisePx);
}

TEST(RigSolve, OutliersAreNamedAndDoNotMoveTheRig) {
  const auto cameras = RowOfCameras(2, 0.1);
  const Rig truth = ExactRig(cameras, 15, 3, false, 2);
  auto views = NoisyViews(truth, kNoisePx, 8);
  const auto clean = SolveRig(kBoard, InputsOf(cameras), views, 15);
  views[3].seen.corners[10].pixel.x() += 1e6;
  views[8].seen.corners[5].pixel.y() += 3;
  const auto solution = SolveRig(kBoard, InputsOf(cameras), views, 15);
  EXPECT_EQ(solution.rig.views[3].outliers, std::vector<int>{10});
  EXPECT_EQ(solution.rig.views[8].outliers, std::vector<int>{5});
  const auto moved = Difference(solution.layout, clean.rig.cameras, solution.rig.cameras);
  EXPECT_LT(moved.dot(clean.covariance.inverse() * moved), 1);
}

TEST(RigSolve, TheUnitOfTheBoardScalesTheRigAndNothingElse) {
  const auto cameras = RowOfCameras(2, 0.1);
  const auto views = NoisyViews(ExactRig(cameras, 12, 3), kNoisePx, 8);
  const auto solution = SolveRig(kBoard, InputsOf(cameras), views, 12);
  for (const double scale : {1e-6, 1e6}) {
    Board scaled = kBoard;
    scaled.square *= scale;
    const auto other = SolveRig(scaled, InputsOf(cameras), views, 12);
    EXPECT_NEAR(other.rms_px, solution.rms_px, 1e-9);
    EXPECT_NEAR(other.rig.cameras[1].cam_from_rig.translation.x() / scale,
                solution.rig.cameras[1].cam_from_rig.translation.x(), 1e-8);
  }
}

// Of one camera and of two: whatever focal length a solve is told to begin with.
TEST(RigSolve, AStartThirtyPercentOffEndsAtTheSameMinimum) {
  for (const int count : {1, 2}) {
    const auto cameras = RowOfCameras(count, 0.1);
    const auto views = NoisyViews(ExactRig(cameras, 15, 3), kNoisePx, 8);
    const auto best = SolveRig(kBoard, InputsOf(cameras), views, 15);
    for (const double factor : {0.7, 1.3}) {
      auto inputs = InputsOf(cameras);
      for (size_t c = 0; c < inputs.size(); ++c) {
        inputs[c].given = cameras[c].camera;
        for (const size_t k : {0, 1}) inputs[c].given->params[k] *= factor;
      }
      const auto solution = SolveRig(kBoard, inputs, views, 15);
      EXPECT_EQ(solution.outliers, best.outliers);
      EXPECT_NEAR(solution.rms_px, best.rms_px, 1e-9);
      // Far below what the noise leaves open: the same minimum. And that one is the truth's.
      const auto moved = Difference(best.layout, best.rig.cameras, solution.rig.cameras);
      EXPECT_LT(moved.dot(best.covariance.inverse() * moved), 1e-6);
      EXPECT_LT(NormalisedError(solution, cameras), 2.5);
    }
  }
}

TEST(RigSolve, CamerasThatNoFrameConnectsAreNamed) {
  const auto cameras = RowOfCameras(2, 0.1);
  auto views = ExactRig(cameras, 24, 3, false, 2).views;
  std::erase_if(views, [](const RigView& v) { return (v.frame < 12) != (v.camera == 0); });
  try {
    SolveRig(kBoard, InputsOf(cameras), views, 24);
    FAIL() << "not rejected";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("cam1"));
  }
}

TEST(RigSolve, OneCameraWhoseLensIsGivenLeavesNothingToSolveFor) {
  const auto cameras = RowOfCameras(1, 0.1);
  auto inputs = InputsOf(cameras);
  inputs[0].given = cameras[0].camera;
  RigOptions options;
  options.free_lenses = false;
  try {
    SolveRig(kBoard, inputs, ExactRig(cameras, 8, 3).views, 8, options);
    FAIL() << "was solved";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("found one camera whose intrinsics are given"),
              std::string::npos)
        << error.what();
  }
}

// The stereo pairs of OpenCV's own set, intrinsics from each side alone, every corner counted.
TEST(RigSolve, TheStereoPairHasOpenCvsRms) {
  const fs::path folder = dtr::testing::DataFolder() / "chessboard_stereo_640x480";
  DTR_REQUIRE_DATA(folder);
  const Board board{Board::Kind::kChessboard, 9, 6, 1, 0, "", false};
  const std::vector<RigCameraInput> inputs{{"left", BoardModel::kBrown5, 640, 480, {}},
                                           {"right", BoardModel::kBrown5, 640, 480, {}}};
  std::vector<RigView> views;
  for (size_t i = 0; i < 14; ++i) {
    for (size_t c = 0; c < 2; ++c) {
      const std::string name =
          inputs[c].name + (i + 1 < 10 ? "0" : "") + std::to_string(i + 1) + ".jpg";
      const Detection found = DetectBoard(GreyOf(io::ReadImage(folder / name)), board);
      views.push_back({c, i, {name, found.corners, found.noise_px}, {}});
    }
  }
  RigOptions options;
  options.solve.loss = Loss::kQuadratic;
  options.free_lenses = false;
  const RigSolution ours = SolveRig(board, inputs, views, 14, options);

  std::vector<std::vector<cv::Point3f>> corners(14);
  std::vector<std::vector<cv::Point2f>> pixels[2];
  for (const RigView& view : ours.rig.views) {  // ends as the repair has them
    pixels[view.camera].emplace_back();
    for (const BoardCorner& c : view.seen.corners) {
      const Eigen::Vector3d p = board.Corner(c.id);
      if (view.camera == 0) corners[view.frame].emplace_back(p.x(), p.y(), 0);
      pixels[view.camera].back().emplace_back(c.pixel.x() - 0.5, c.pixel.y() - 0.5);
    }
  }
  cv::Mat k[2], d[2], r, t, e, f;
  for (int c = 0; c < 2; ++c) {
    std::vector<cv::Mat> rotations, translations;
    cv::calibrateCamera(corners, pixels[c], {640, 480}, k[c], d[c], rotations, translations);
  }
  const double theirs = cv::stereoCalibrate(
      corners, pixels[0], pixels[1], k[0], d[0], k[1], d[1], {640, 480}, r, t, e, f,
      cv::CALIB_FIX_INTRINSIC, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12});
  std::printf("stereo RMS %.6f px (OpenCV %.6f)\n", ours.rms_px, theirs);
  EXPECT_NEAR(ours.rms_px, theirs, 1e-3 * theirs);
  EXPECT_NEAR(ours.rms_px, 0.205, 5e-4);  // the published figure has three decimals
  const Pose& right = ours.rig.cameras[1].cam_from_rig;
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(right.translation[i], t.at<double>(i), 2e-3);
}

}  // namespace
}  // namespace dtr::calib
