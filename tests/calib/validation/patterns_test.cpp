// What is tested for must be found, and what is not there must not be.
#include "calib/validation/patterns.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/calib/solve/synthetic_rig.h"

namespace dtr::calib {
namespace {

using namespace testing;
constexpr double kNoisePx = 0.1;

RigSolution SolvedOne(BoardModel truth, BoardModel model, std::uint64_t seed,
                      const std::function<void(const BoardView&, BoardCorner&)>& spoil = {}) {
  const LensCamera camera = TypicalCamera(truth);
  auto views = Noisy(ExactViews(camera, 20, seed).views, kNoisePx, seed + 50);
  std::vector<RigView> rig_views;
  for (BoardView& view : views) {
    for (BoardCorner& corner : view.corners) {
      if (spoil) spoil(view, corner);
    }
    rig_views.push_back({0, rig_views.size(), view, {}});
  }
  const std::vector<RigCameraInput> inputs{{"cam", model, 640, 480, {}}};
  RigOptions options;
  options.solve.cover_image = false;
  return SolveRig(kBoard, inputs, rig_views, views.size(), options);
}

TEST(Patterns, OfNoiseEveryShareOfTheTestsIsAsRareAsItsP) {
  // 12 solves, 4 patterns: p is uniform, so its mean is 0.5 within 0.29 / sqrt(48) = 0.042.
  double mean = 0, least = 1;
  constexpr int kSolves = 12;
  for (int k = 0; k < kSolves; ++k) {
    const auto solution =
        SolvedOne(BoardModel::kBrown4, BoardModel::kBrown4, 10 + static_cast<unsigned>(k));
    for (const double p :
         {TestRadial(solution).p, TestRegional(solution).p, TestBoardShape(kBoard, solution).p,
          TestRollingShutter(kBoard, solution).p}) {
      mean += p / (4 * kSolves);
      least = std::min(least, p);
    }
  }
  EXPECT_NEAR(mean, 0.5, 4.5 * 0.042);
  EXPECT_GT(least, 1e-4);
}

TEST(Patterns, ALensThatTheModelCannotFollowShowsAlongTheRadius) {
  const auto solution = SolvedOne(BoardModel::kBrown4, BoardModel::kPinhole, 3);
  const PatternTest radial = TestRadial(solution);
  EXPECT_LT(radial.p, 1e-12);
  EXPECT_GT(radial.amplitude_px, 0.1);
  EXPECT_LT(TestRegional(solution).p, 1e-12);
}

TEST(Patterns, ABentBoardIsTheBoardAndNoRollingShutter) {
  const LensCamera camera = TypicalCamera(BoardModel::kBrown4);
  const LensMap lens(camera);
  const auto exact = ExactViews(camera, 20, 6);
  std::vector<RigView> views;
  Random random(4);
  for (size_t i = 0; i < exact.views.size(); ++i) {
    RigView view{0, i, exact.views[i], {}};
    for (BoardCorner& corner : view.seen.corners) {
      Eigen::Vector3d p = kBoard.Corner(corner.id);
      const double x = (p - MiddleOf(kBoard)).x() / 0.12;
      p.z() += 0.001 * x * x;  // a sheet of 27 cm, bent by 1 mm
      corner.pixel = *lens.PixelFromCam(exact.cam_from_board[i] * p);
      corner.pixel += kNoisePx * Eigen::Vector2d(random.Normal(), random.Normal());
    }
    views.push_back(view);
  }
  const std::vector<RigCameraInput> inputs{{"cam", BoardModel::kBrown4, 640, 480, {}}};
  const auto solution = SolveRig(kBoard, inputs, views, views.size());
  EXPECT_LT(TestBoardShape(kBoard, solution).p, 1e-12);
  EXPECT_GT(TestRollingShutter(kBoard, solution).p, 1e-4);
}

TEST(Patterns, ARollingShutterIsFound) {
  Random random(3);
  std::vector<Eigen::Vector2d> speeds;
  for (int i = 0; i < 20; ++i) speeds.emplace_back(3 * random.Normal(), 3 * random.Normal());
  const auto solution = SolvedOne(
      BoardModel::kBrown4, BoardModel::kBrown4, 8, [&](const BoardView& view, BoardCorner& corner) {
        const auto index = static_cast<size_t>(std::stoi(view.name.substr(4)));
        corner.pixel += speeds[index] * (corner.pixel.y() / 480 - 0.5);
      });
  EXPECT_LT(TestRollingShutter(kBoard, solution).p, 1e-12);
  EXPECT_GT(TestBoardShape(kBoard, solution).p, 1e-6);
}

// The views of camera 1 as it sees the board a share of a frame later than `truth` says.
std::vector<RigView> WithLateCamera(const Rig& truth, double late, std::vector<RigView> views) {
  Random random(9);
  for (RigView& view : views) {
    if (view.camera != 1 || view.frame + 1 >= truth.rig_from_board.size()) continue;
    const Pose &now = truth.rig_from_board[view.frame],
               &next = truth.rig_from_board[view.frame + 1];
    const Pose then{now.rotation.slerp(late, next.rotation),
                    (1 - late) * now.translation + late * next.translation};
    const RigCamera& camera = truth.cameras[1];
    const LensMap lens(camera.camera);
    for (BoardCorner& corner : view.seen.corners) {
      const auto pixel = lens.PixelFromCam(camera.cam_from_rig * (then * kBoard.Corner(corner.id)));
      if (pixel) {
        corner.pixel = *pixel + kNoisePx * Eigen::Vector2d(random.Normal(), random.Normal());
      }
    }
  }
  return views;
}

constexpr double kLate = 0.2;

// Cameras solved as if they had one clock: lenses, too, follow what the clocks do.
RigOptions AsIfSynchronised() {
  RigOptions options;
  options.solve.outlier_sigmas = 50;
  options.solve.cover_image = false;
  return options;
}

TEST(Patterns, ALateCameraIsFoundAndTimed) {
  const auto cameras = RowOfCameras(2, 0.1);
  // The same path, twice: as the first camera sees it, and a fifth of a frame later.
  const Rig truth = ExactRig(cameras, 40, 5, true, 2);
  const auto views = WithLateCamera(truth, kLate, NoisyViews(truth, kNoisePx, 6));
  const auto solution =
      SolveRig(kBoard, InputsOf(cameras), views, truth.rig_from_board.size(), AsIfSynchronised());
  const PatternTest late = TestTimeOffset(solution);
  ASSERT_EQ(late.coefficients.size(), 1u);
  EXPECT_LT(late.p, 1e-12);
  EXPECT_NEAR(late.coefficients[0], kLate, 0.25 * kLate);
  const auto clean = SolveRig(kBoard, InputsOf(cameras), NoisyViews(truth, kNoisePx, 6),
                              truth.rig_from_board.size());
  EXPECT_GT(TestTimeOffset(clean).p, 1e-4);
}

TEST(Patterns, ACameraThatTellsNoTimeDoesNotHideALateOne) {
  const auto cameras = RowOfCameras(3, 0.1);
  const Rig truth = ExactRig(cameras, 40, 5, true, 2);
  auto views = WithLateCamera(truth, kLate, NoisyViews(truth, kNoisePx, 6));
  // Camera 2 sees the last ten frames alone, which are taken with pauses between them.
  constexpr size_t kPauses = 30;
  std::erase_if(views, [](const RigView& v) { return v.camera == 2 && v.frame < kPauses; });
  for (RigView& view : views) {
    if (view.frame >= kPauses) view.frame = kPauses + 1 + 2 * (view.frame - kPauses);
  }
  const auto solution = SolveRig(kBoard, InputsOf(cameras), views, 60, AsIfSynchronised());
  const PatternTest late = TestTimeOffset(solution);
  ASSERT_EQ(late.coefficients.size(), 2u);
  // Of 30 frames with three lenses free the solve takes up some of it; what is left is no chance.
  EXPECT_GT(late.coefficients[0], 4.5 * late.sigmas[0]);
  EXPECT_LT(late.coefficients[0], 1.25 * kLate);
  EXPECT_TRUE(std::isnan(late.coefficients[1]));
}

}  // namespace
}  // namespace dtr::calib
