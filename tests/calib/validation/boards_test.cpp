#include "calib/validation/boards.h"

#include <gmock/gmock.h>

#include "tests/calib/validation/injected_faults.h"

namespace dtr::calib {
namespace {

using namespace testing;
using ::testing::HasSubstr;

Check TestOf(const BoardValidation& report, const std::string& name) {
  static const Check kNone;
  for (const Check& test : report.tests) {
    if (test.name == name) return test;
  }
  ADD_FAILURE() << "no test " << name;
  return kNone;
}

TEST(ValidateBoards, AnHonestCalibrationPasses) {
  Tally tally;
  ValidateHonest(1, tally);
  ValidateHonest(2, tally);
  EXPECT_EQ(tally.honest_passed, tally.honest);
}

// One of each kind that is quick; the slow test has them all, by seed.
class FaultyBoards : public ::testing::TestWithParam<FaultInjection> {};

TEST_P(FaultyBoards, IsCaughtByTheTestThatIsMeantForIt) {
  Tally tally;
  for (std::uint64_t seed = 5; tally.faults() < 1; ++seed) {
    ValidateFaultInjection(GetParam(), seed, tally);
  }
  EXPECT_EQ(tally.caught, 1);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, FaultyBoards,
    ::testing::Values(FaultInjection::kFocal, FaultInjection::kMirroredBoard,
                      FaultInjection::kSquareSize, FaultInjection::kRollingShutter,
                      FaultInjection::kRepeatedViews, FaultInjection::kFewViews,
                      FaultInjection::kClusteredViews, FaultInjection::kFrontoParallel));

TEST(ValidateBoards, TestViewsReportAWrongLens) {
  Scene scene = OneCamera(24, 9);
  const RigSolution solution = SolveScene(scene, kCornerNoisePx, 1);
  Scene others = OneCamera(24, 9 + 3000);
  others.cameras = scene.cameras;
  const auto exact = ExactViews(scene.cameras[0].camera, 24, 77);
  TestViews unseen;
  for (const BoardView& view : Noisy(exact.views, kCornerNoisePx, 2)) {
    unseen.views.push_back({0, unseen.frames++, view, {}});
  }
  ValidatedCalibration calibration = CalibrationOf(solution);
  const BoardValidation good = ValidateBoards(calibration, unseen, {});
  EXPECT_TRUE(TestOf(good, "lens_difference_sigmas").passed)
      << TestOf(good, "lens_difference_sigmas").reason;
  EXPECT_TRUE(TestOf(good, "test_rms_px").passed);
  // The noise is 0.1 px per coordinate: 0.141 px the length.
  EXPECT_NEAR(TestOf(good, "test_rms_px").value, 0.141, 0.01);
  calibration.cameras[0].camera.params[0] *= 1.01;
  calibration.cameras[0].camera.params[1] *= 1.01;
  const BoardValidation bad = ValidateBoards(calibration, unseen, {});
  EXPECT_FALSE(TestOf(bad, "lens_difference_sigmas").passed);
  EXPECT_THAT(TestOf(bad, "lens_difference_sigmas").reason, HasSubstr("f"));
}

// What is stored must be what the kept views say, whatever unseen ones allow.
TEST(ValidateBoards, TestViewsDoNotExcuseWhatTheKeptOnesContradict) {
  const Scene scene = OneCamera(24, 9);
  const RigSolution solution = SolveScene(scene, kCornerNoisePx, 1);
  const auto exact = ExactViews(scene.cameras[0].camera, 24, 77);
  TestViews unseen;
  for (const BoardView& view : Noisy(exact.views, kCornerNoisePx, 2)) {
    unseen.views.push_back({0, unseen.frames++, view, {}});
  }
  ValidatedCalibration calibration = CalibrationOf(solution);
  // Two standard deviations: no more than two solves differ by.
  const double sigma = std::sqrt(solution.covariance(0, 0));
  calibration.cameras[0].camera.params[0] += 2 * sigma;
  const BoardValidation report = ValidateBoards(calibration, unseen, {});
  const Check lens = TestOf(report, "lens_difference_sigmas");
  EXPECT_FALSE(lens.passed) << lens.reason;
  EXPECT_EQ(lens.limit, BoardLimits{}.max_self_difference_sigmas);
  EXPECT_THAT(lens.reason, HasSubstr("fresh solve"));
}

// Corners in the middle of the image alone say nothing of what a fisheye's higher terms do farther
// out: that is no camera to rely on, however well it fits.
TEST(ValidateBoards, TermsThatTheCornersLeaveOpenFailByName) {
  const auto terms_of = [](double outermost_px) {
    const Scene scene = MiddleOfFisheye(9, outermost_px);
    return TestOf(ValidateBoards(CalibrationOf(SolveScene(scene, kCornerNoisePx, 1)), {}, {}),
                  "undetermined_terms");
  };
  const Check all = terms_of(1000), middle = terms_of(130);
  EXPECT_TRUE(all.passed) << all.value << " " << all.reason;
  EXPECT_FALSE(middle.passed) << middle.value;
  EXPECT_THAT(middle.reason, HasSubstr("cam: k4 = "));
}

TEST(ValidateBoards, PixelsWithoutARayAreNotForgotten) {
  RigSolution solution = SolveScene(OneCamera(24, 10), kCornerNoisePx, 1);
  solution.rig.cameras[0].camera = CameraFrom(
      BoardModel::kBrown4, 640, 480, std::vector<double>{530, 532, 322, 236, -0.5, 0, 0, 0});
  solution.rig.cameras[0].model = BoardModel::kBrown4;
  solution.layout = RigLayout(solution.rig.cameras, true);
  const Eigen::MatrixXd nothing =
      Eigen::MatrixXd::Zero(solution.layout.size(), solution.layout.size());
  solution.rows = RowsOf(kBoard, solution.rig, solution.layout);
  const ProjectionSensitivity sensitivity(solution);
  const ImageMap map = UncertaintyMap(solution, sensitivity, nothing, 0, 2);
  EXPECT_TRUE(std::isinf(map.Quantile(0.95)));
  EXPECT_EQ(map.Largest(), 0);  // of what has a ray
  EXPECT_EQ(map.Quantile(0.1), 0);
}

TEST(ValidateBoards, PredictedProjectionUncertaintyIsTheSpreadOfManySolves) {
  const Scene scene = OneCamera(12, 4);
  const RigSolution one = SolveScene(scene, kCornerNoisePx, 1);
  const ProjectionSensitivity sensitivity(one);
  const double distance = BoardDistance(kBoard, one.rig, 0);
  const Eigen::Vector2d pixel(560, 400);
  const Eigen::MatrixXd by_shared = *sensitivity.At(0, pixel, distance);
  const double predicted = std::sqrt((by_shared * one.covariance * by_shared.transpose()).trace());
  constexpr int kSolves = 40;
  double squares = 0;
  for (int k = 0; k < kSolves; ++k) {
    const RigSolution other = SolveScene(scene, kCornerNoisePx, 100 + static_cast<unsigned>(k));
    const Eigen::VectorXd off = Difference(one.layout, scene.cameras, other.rig.cameras);
    squares += (by_shared * off).squaredNorm() / kSolves;
  }
  // The spread of 40 draws of two coordinates is known within 11 %.
  EXPECT_NEAR(std::sqrt(squares) / predicted, 1, 0.35);
}

TEST(ValidateBoards, WithoutViewsThereIsNothingToValidate) {
  ValidatedCalibration calibration;
  calibration.board = kBoard;
  calibration.cameras.push_back(
      {"cam", BoardModel::kPinhole, TypicalCamera(BoardModel::kPinhole), {}});
  EXPECT_THROW(ValidateBoards(calibration, {}, {}), Error);
}

TEST(ValidateBoards, TheReportIsJsonWithTheDocumentedNames) {
  const FaultInjectionCase honest = Honest(1);
  const std::string json = ToJson(ValidateBoards(honest.calibration, {}, {}));
  for (const char* name : {"\"passed\"", "\"tests\"", "\"limit\"", "\"reason\"", "\"cameras\"",
                           "\"uncertainty_px\"", "\"condition\""}) {
    EXPECT_THAT(json, HasSubstr(name));
  }
}

}  // namespace
}  // namespace dtr::calib
