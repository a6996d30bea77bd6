// Which way photos were rotated, by the camera of the others.
#include "calib/solve/rotated_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "tests/calib/solve/synthetic_views.h"
#include "tests/support/message_of.h"

namespace dtr::calib {
namespace {

using namespace testing;
using ::testing::HasSubstr;

constexpr double kNoisePx = 0.1;  // of photos

// What the detector sees once a program has rotated the photo.
BoardView Rotated(const BoardView& on_sensor, PhotoRotation rotation, int width_px, int height_px) {
  BoardView view = on_sensor;
  for (BoardCorner& corner : view.corners) {
    const Eigen::Vector2d p = corner.pixel;
    corner.pixel = rotation == PhotoRotation::kClockwise ? Eigen::Vector2d(height_px - p.y(), p.x())
                                                         : Eigen::Vector2d(p.y(), width_px - p.x());
  }
  return view;
}

// Every third view is rotated counterclockwise where `both`, else all are rotated clockwise.
std::vector<FoundRotation> FoundOf(const LensCamera& camera, const LensCamera& of_rotated,
                                   int rotated, bool both = false, double noise_px = kNoisePx) {
  const auto upright = Noisy(ExactViews(camera, 10, 1).views, noise_px, 2);
  auto views = Noisy(ExactViews(of_rotated, rotated, 3).views, noise_px, 4);
  for (size_t i = 0; i < views.size(); ++i) {
    views[i] = Rotated(
        views[i], both && i % 3 == 2 ? PhotoRotation::kCounterclockwise : PhotoRotation::kClockwise,
        camera.width_px, camera.height_px);
  }
  return FindRotations(kBoard, views,
                       ReferenceFrom(kBoard, upright, camera.width_px, camera.height_px));
}

LensCamera WithParams(std::vector<double> params) {
  return CameraFrom(BoardModel::kBrown4, 640, 480, params);
}

TEST(RotatedViews, ACornerGoesBackToWhereTheSensorSawIt) {
  // A photo of 640 x 480, rotated: the sensor's (10, 20) comes to (480 - 20, 10), or to (20, 630).
  const BoardView clockwise{"", {{0, {460, 10}}}, 0}, counterclockwise{"", {{0, {20, 630}}}, 0};
  const Eigen::Vector2d expected(10, 20);
  EXPECT_EQ(OnSensorGrid(clockwise, PhotoRotation::kClockwise, 640, 480).corners[0].pixel,
            expected);
  const BoardView back = OnSensorGrid(counterclockwise, PhotoRotation::kCounterclockwise, 640, 480);
  EXPECT_EQ(back.corners[0].pixel, expected);
  EXPECT_EQ(back.rotation, PhotoRotation::kCounterclockwise);
}

TEST(RotatedViews, EveryLensModelTellsTheWayOfPhotosRotatedBothWays) {
  for (const BoardModel model : {BoardModel::kBrown4, BoardModel::kFisheye}) {
    std::vector<double> params = TypicalCamera(model).params;
    params[2] = 340;  // half a per cent beside the middle would not do for each view by itself
    params[3] = 230;
    const LensCamera camera = CameraFrom(model, 640, 480, params);
    const auto found = FoundOf(camera, camera, 6, true);
    for (size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].undecided, "") << NameOf(model) << " " << i;
      EXPECT_EQ(found[i].rotation,
                i % 3 == 2 ? PhotoRotation::kCounterclockwise : PhotoRotation::kClockwise)
          << NameOf(model) << " " << i;
    }
  }
}

// 4 px beside the middle: no view leaves twice as much one way as the other.
TEST(RotatedViews, ManyViewsThatAgreeDecideWhereNoneDoesAlone) {
  const LensCamera camera = WithParams({530, 530, 323, 238, -0.28, 0.08, 0, 0});
  for (const FoundRotation& found : FoundOf(camera, camera, 24)) {
    EXPECT_EQ(found.undecided, "");
    EXPECT_EQ(found.rotation, PhotoRotation::kClockwise);
  }
  for (const FoundRotation& found : FoundOf(camera, camera, 1)) {
    EXPECT_THAT(found.undecided, HasSubstr("both ways agree"));
  }
}

TEST(RotatedViews, ACameraThatIsTheSameUpsideDownLeavesThemUndecided) {
  const LensCamera camera = WithParams({530, 530, 320, 240, -0.28, 0.08, 0, 0});
  EXPECT_THAT(dtr::testing::MessageOf<Error>([&] { FoundOf(camera, camera, 12); }),
              HasSubstr("principal point is in the middle"));
  const auto upright = Noisy(ExactViews(camera, 12, 1).views, kNoisePx, 2);
  for (const FoundRotation& found : FindRotations(kBoard, upright, {camera, {}})) {
    EXPECT_THAT(found.undecided, HasSubstr("both ways agree"));
  }
}

TEST(RotatedViews, PhotosOfAnotherCameraAreNotTakenForRotatedOnes) {
  const LensCamera other = WithParams({530, 530, 300, 260, 0.05, 0, 0, 0});
  for (const FoundRotation& found : FoundOf(TypicalCamera(BoardModel::kBrown4), other, 6)) {
    EXPECT_THAT(found.undecided, HasSubstr("neither rotation agrees"));
  }
}

TEST(RotatedViews, ExactViewsOfADrawnBoardAreNotTakenForAnotherCameras) {
  const LensCamera camera = TypicalCamera(BoardModel::kBrown4);
  for (const FoundRotation& found : FoundOf(camera, camera, 3, false, 0)) {
    EXPECT_EQ(found.rotation, PhotoRotation::kClockwise) << found.undecided;
  }
}

TEST(RotatedViews, TwoViewsDetermineNoCameraToCompareWith) {
  const auto two = ExactViews(TypicalCamera(BoardModel::kBrown4), 2, 1).views;
  EXPECT_THROW(ReferenceFrom(kBoard, two, 640, 480), std::exception);
}

}  // namespace
}  // namespace dtr::calib
