#include "viewer/controller.h"

#include <gtest/gtest.h>

#include <numbers>

#include "dtr/base/random.h"
#include "dtr/render/geometry.h"
#include "dtr/render/opening_view.h"

namespace dtr::viewer {
namespace {

constexpr double kSame = 1e-9;
constexpr int kWidthPx = 640, kHeightPx = 400;
const Eigen::Vector3d kUp(0, -1, 0);

/// Four cameras in a row, 10 before the middle of a scene, and a held-out one.
DtrSet FourCameras() {
  DtrSet set;
  set.bounds = {{-4, -4, -4}, {4, 4, 4}};
  set.frames.resize(1);
  for (int i = 0; i < 5; ++i) {
    View view;
    view.id = std::string(1, static_cast<char>('d' - i));  // d, c, b, a and `
    view.name = view.id + ".jpg";
    view.camera = {320, 200, 250, 250, 160, 100};
    const Eigen::Vector3d center(i, 0, -10);
    view.cam_from_world = LookAlong(center, -center, kUp);
    if (i == 4) view.role = ViewRole::kHeldOut;
    set.frames[0].views.push_back(view);
  }
  return set;
}

class ControllerTest : public ::testing::Test {
 protected:
  Controller Make() {
    return {SurroundingsOf(set_), kUp, kWidthPx, kHeightPx,
            [this](const Eigen::Vector2d&) { return depth_; }};
  }
  static void Wait(Controller& controller, double seconds) {
    for (double t = 0; t < seconds; t += 0.05) controller.Advance(0.05);
  }
  static Eigen::Vector3d Center(const Controller& controller) {
    return controller.camera().cam_from_world.TargetOriginInSource();
  }
  DtrSet set_ = FourCameras();
  std::optional<double> depth_ = 10;
};

TEST_F(ControllerTest, BeginsInTheMiddleOfTheCamerasThatLookAtTheScene) {
  const Surroundings four = SurroundingsOf(set_);
  EXPECT_EQ(four.views[OpeningView(four.views, four.center)]->id,
            "b");  // of the two in the middle, the nearer one
  // Where that one looks away from the scene it is another.
  View& b = set_.frames[0].views[2];
  b.cam_from_world = LookAlong(b.CenterInWorld(), Eigen::Vector3d(0, 0, -1), kUp);
  const Surroundings turned = SurroundingsOf(set_);
  EXPECT_NE(turned.views[OpeningView(turned.views, turned.center)]->id, "b");
}

TEST_F(ControllerTest, BeginsAtAnInputCameraAndStepsThroughThemInOrder) {
  Controller controller = Make();
  EXPECT_EQ(controller.surroundings().views.size(), 4u);  // not the held-out one
  EXPECT_EQ(controller.surroundings().cameras.size(), 5u);
  std::string visited;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(controller.at_view());
    visited += controller.surroundings().cameras[*controller.at_view()]->id;
    controller.StepViews(1);
    EXPECT_TRUE(controller.moving());
    Wait(controller, 1);
    EXPECT_FALSE(controller.moving());
  }
  EXPECT_EQ(visited, "bcd`a") << "from the opening view, by the held-out one, and on";
  controller.StepViews(-2);
  Wait(controller, 1);
  EXPECT_EQ(controller.at_view(), 0u);
  // Steps asked for while on the way add up.
  controller.StepViews(1);
  controller.Advance(0.05);
  controller.StepViews(1);
  Wait(controller, 1);
  EXPECT_EQ(controller.at_view(), 2u);
  EXPECT_EQ(controller.camera().camera, FillLens(set_.frames[0].views[0].camera, 640, 400));
}

TEST_F(ControllerTest, ThePhotoFillsTheWindowHoweverOftenThatChanges) {
  Controller controller = Make();
  const PinholeCamera photo = set_.frames[0].views[0].camera;
  for (const auto& [width, height] : {std::pair(200, 700), {1200, 100}, {640, 400}}) {
    controller.Resize(width, height);
    EXPECT_EQ(controller.camera().camera, FillLens(photo, width, height));
  }
}

TEST_F(ControllerTest, ADragAcrossTheWindowOrbitsAsFarAsThePhotosSpan) {
  for (const double apart : {1.0, 4.0}) {
    for (size_t i = 0; i < 5; ++i) {
      const Eigen::Vector3d center(apart * (static_cast<double>(i) - 1.5), 0, -10);
      set_.frames[0].views[i].cam_from_world = LookAlong(center, -center, kUp);
    }
    Controller controller = Make();
    const double span =
        CameraSpan(controller.surroundings().views, controller.surroundings().center);
    EXPECT_NEAR(span, 2 * std::atan2(1.5 * apart, 10), kSame);
    const Eigen::Vector3d from = Center(controller);
    const Eigen::Vector3d pivot = WorldPoint(controller.camera(), {0, 200}, *depth_);
    controller.Handle(ButtonEvent{Button::kLeft, true, 0, 200});
    controller.Handle(MoveEvent{kWidthPx, 200});
    EXPECT_NEAR(AngleBetween(from - pivot, Center(controller) - pivot),
                std::max(span, std::numbers::pi / 8), 1e-6);
  }
}

TEST_F(ControllerTest, AHeldOutCameraIsReachedButNotTakenForASourceView) {
  Controller controller = Make();
  controller.StepViews(-2);
  Wait(controller, 1);
  ASSERT_EQ(controller.at_view(), 0u);
  EXPECT_EQ(controller.surroundings().cameras[0]->role, ViewRole::kHeldOut);
  EXPECT_EQ(controller.nearest_view(), 0u);
  ASSERT_TRUE(controller.nearest_source());
  EXPECT_EQ(controller.surroundings().views[*controller.nearest_source()]->id, "a");
}

TEST_F(ControllerTest, AfterADragStepsGoOnFromTheNearestView) {
  Controller controller = Make();
  controller.JumpTo({controller.camera().camera,
                     LookAlong({0.2, 0, -10}, {0, 0, 1}, kUp)});  // beside "d", the last
  EXPECT_FALSE(controller.at_view());
  controller.StepViews(1);
  Wait(controller, 1);
  EXPECT_EQ(controller.at_view(), 0u);
}

TEST_F(ControllerTest, LeftDragOrbitsAboutThePointUnderTheCursor) {
  Controller controller = Make();
  const Eigen::Vector2d start(200, 150);
  const Eigen::Vector3d pivot = WorldPoint(controller.camera(), start, *depth_);
  controller.Handle(ButtonEvent{Button::kLeft, true, start.x(), start.y()});
  for (int x = 201; x <= 300; x += 9) controller.Handle(MoveEvent{static_cast<double>(x), 180});
  controller.Handle(ButtonEvent{Button::kLeft, false, 300, 180});
  const auto pixel =
      controller.camera().camera.PixelFromCam(controller.camera().cam_from_world * pivot);
  ASSERT_TRUE(pixel);
  EXPECT_LT((*pixel - start).norm(), 1e-6);
  EXPECT_FALSE(controller.at_view());
  const Pose after = controller.camera().cam_from_world;
  controller.Handle(MoveEvent{50, 50});  // let go: nothing more
  EXPECT_EQ(after.translation, controller.camera().cam_from_world.translation);
}

TEST_F(ControllerTest, RightDragLooksMiddleDragMovesAcross) {
  Controller controller = Make();
  const Eigen::Vector3d center = Center(controller);
  controller.Handle(ButtonEvent{Button::kRight, true, 200, 150});
  controller.Handle(MoveEvent{260, 150});
  controller.Handle(ButtonEvent{Button::kRight, false, 260, 150});
  EXPECT_LT((Center(controller) - center).norm(), kSame);
  EXPECT_FALSE(controller.at_view());
  const Eigen::Vector3d point = WorldPoint(controller.camera(), {200, 150}, *depth_);
  controller.Handle(ButtonEvent{Button::kMiddle, true, 200, 150});
  controller.Handle(MoveEvent{230, 170});
  controller.Handle(MoveEvent{260, 100});
  const auto pixel =
      controller.camera().camera.PixelFromCam(controller.camera().cam_from_world * point);
  EXPECT_LT((*pixel - Eigen::Vector2d(260, 100)).norm(), 1e-6);
}

TEST_F(ControllerTest, TheWheelApproachesOrChangesTheSpeedOfFlight) {
  Controller controller = Make();
  const double speed = controller.fly_speed();
  const Eigen::Vector3d point = WorldPoint(controller.camera(), {100, 90}, *depth_);
  const double distance = (Center(controller) - point).norm();
  controller.Handle(ScrollEvent{2, 100, 90});
  EXPECT_LT((Center(controller) - point).norm(), 0.8 * distance);
  EXPECT_EQ(controller.fly_speed(), speed);
  const Eigen::Vector3d here = Center(controller);
  controller.Handle(FlyEvent{FlyKey::kForward, true});
  controller.Handle(ScrollEvent{2, 100, 90});
  EXPECT_GT(controller.fly_speed(), 1.5 * speed);
  EXPECT_EQ(Center(controller), here);
  for (int i = 0; i < 1000; ++i) controller.Handle(ScrollEvent{-10, 0, 0});
  EXPECT_GT(controller.fly_speed(), 0);
}

TEST_F(ControllerTest, FlyKeysMoveAlongTheCamerasAxesAsLongAsTheyAreHeld) {
  for (const auto& [key, direction] : {std::pair(FlyKey::kForward, Eigen::Vector3d(0, 0, 1)),
                                       {FlyKey::kLeft, {-1, 0, 0}},
                                       {FlyKey::kUp, {0, -1, 0}}}) {
    Controller controller = Make();
    const Pose before = controller.camera().cam_from_world;
    controller.Handle(FlyEvent{key, true});
    EXPECT_TRUE(controller.moving());
    for (int i = 0; i < 10; ++i) controller.Advance(0.05);
    controller.Handle(FlyEvent{key, false});
    EXPECT_FALSE(controller.moving());
    const Eigen::Vector3d way = before * Center(controller);
    EXPECT_LT((way - 0.5 * controller.fly_speed() * direction).norm(), kSame * 100);
  }
}

TEST_F(ControllerTest, AKeyTappedBetweenTwoFramesStillMoves) {
  Controller controller = Make();
  const Eigen::Vector3d before = Center(controller);
  controller.Handle(FlyEvent{FlyKey::kForward, true});
  controller.Handle(FlyEvent{FlyKey::kForward, false});
  EXPECT_TRUE(controller.moving());
  controller.Advance(0.001);
  EXPECT_GT((Center(controller) - before).norm(), 0);
  EXPECT_FALSE(controller.moving());
}

TEST_F(ControllerTest, AWindowThatLosesItsInputLetsGoOfEverything) {
  Controller controller = Make();
  controller.Handle(FlyEvent{FlyKey::kForward, true});
  controller.Handle(ButtonEvent{Button::kLeft, true, 5, 5});
  controller.Advance(0.05);
  controller.Handle(FocusLostEvent{});
  EXPECT_FALSE(controller.moving());
  EXPECT_FALSE(controller.dragging());
}

TEST_F(ControllerTest, WhereNothingIsSeenTheScenesMiddleSaysHowFar) {
  depth_.reset();
  Controller controller = Make();
  const double before = Center(controller).norm();
  controller.Handle(ScrollEvent{1, 320, 200});
  EXPECT_LT(Center(controller).norm(), before);
  EXPECT_GT(Center(controller).norm(), 0.5 * before);
}

TEST_F(ControllerTest, OverviewHasTheWholeSceneWhereverTheCameraIs) {
  Controller controller = Make();
  controller.Handle(ScrollEvent{3, 320, 200});
  const NovelCamera all = controller.Overview();
  for (const double x : {-4, 4}) {
    const auto pixel = all.camera.PixelFromCam(all.cam_from_world * Eigen::Vector3d(x, x, 4));
    ASSERT_TRUE(pixel);
    EXPECT_GE(pixel->x(), -1e-6);
    EXPECT_LE(pixel->y(), kHeightPx + 1e-6);
  }
}

TEST_F(ControllerTest, HomeIsWhereItBegan) {
  Controller controller = Make();
  const NovelCamera start = controller.camera();
  controller.Handle(ScrollEvent{3, 320, 200});
  controller.StepViews(1);
  Wait(controller, 1);
  controller.GoTo(controller.home());
  Wait(controller, 1);
  EXPECT_LT(
      (controller.camera().cam_from_world.translation - start.cam_from_world.translation).norm(),
      1e-12);
  EXPECT_EQ(controller.camera().camera.fx_px(), start.camera.fx_px());
}

TEST_F(ControllerTest, AnyInputLeavesAFinitePose) {
  Random random(7);
  Controller controller = Make();
  for (int i = 0; i < 20000; ++i) {
    const double x = random.Uniform(-100, 800), y = random.Uniform(-100, 600);
    depth_ = random.Index(3) == 0 ? std::nullopt : std::optional(random.Uniform(1e-3, 1e3));
    switch (random.Index(7)) {
      case 0:
        controller.Handle(
            ButtonEvent{static_cast<Button>(random.Index(3)), random.Index(2) == 0, x, y});
        break;
      case 1:
      case 2:
        controller.Handle(MoveEvent{x, y});
        break;
      case 3:
        controller.Handle(ScrollEvent{random.Uniform(-3, 3), x, y});
        break;
      case 4:
        controller.Handle(
            FlyEvent{static_cast<FlyKey>(random.Index(kFlyKeys)), random.Index(2) == 0});
        break;
      case 5:
        controller.StepViews(random.Index(7) - 3);
        break;
      default:
        controller.Advance(random.Uniform(0, 0.2));
    }
    const Pose& pose = controller.camera().cam_from_world;
    ASSERT_TRUE(pose.translation.allFinite()) << i;
    ASSERT_NEAR(pose.rotation.norm(), 1, 1e-6) << i;
  }
}

// The cameras stand 10 from the middle, as the sky does not.
TEST_F(ControllerTest, AllThatIsShownLeavesOutTheSky) {
  const auto back = [&] {
    Controller controller = Make();
    controller.GoTo(controller.Overview());
    Wait(controller, 1);
    return Center(controller).norm();
  };
  const double scene_alone = back();
  set_.bounds = {{-20, -4, -4}, {30, 4, 4}};
  const double wide = back();
  EXPECT_GT(wide, 2 * scene_alone) << "what is as far as a few times the cameras is shown";
  set_.bounds = {{-4, -5000, -4}, {4, 4, 20000}};
  const double sky = back();
  EXPECT_LT(sky, 20 * 10) << "what is at the horizon is not";
  EXPECT_GT(sky, scene_alone);
}

TEST(Foreground, IsAllOfItWhereNothingWouldBeLeft) {
  DtrSet set = FourCameras();
  set.bounds = {{900, 900, 900}, {901, 901, 901}};
  EXPECT_EQ(Foreground(SurroundingsOf(set)).min, set.bounds.min);
  EXPECT_EQ(Foreground(SurroundingsOf(set)).max, set.bounds.max);
  set.bounds = {};
  EXPECT_TRUE(Foreground(SurroundingsOf(set)).empty());
}

}  // namespace
}  // namespace dtr::viewer
