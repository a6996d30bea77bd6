// Moving sets as nodes: which time step is shown, by hand and by the viewer's time.
#include "tests/gl/gl_testing.h"
// clang-format keeps this group apart.
#include <limits>
#include <osg/MatrixTransform>

#include "dtr/base/error.h"
#include "dtr/render/time_steps.h"
#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"
#include "viewer/osg/key_handler.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;
using Threading = osgViewer::ViewerBase::ThreadingModel;

constexpr double kStep = 0.5;

/// A square before a plane that moves to the right and nearer, at 0, 0.5 and 1.0 s.
DtrSet MovingSquare() {
  DtrSet moving = SquareBeforePlane();
  for (int t = 1; t < 3; ++t) {
    const Surface surface = Union(Square(0.6 * t, 0, 5 - 0.5 * t, 1), Plane({0, 0, 1}, 10));
    Frame frame;
    frame.time_s = kStep * t;
    for (const View& before : moving.frames[0].views) {
      Shot shot;
      shot.id = "t" + std::to_string(t) + before.id;
      shot.cam_from_world = before.cam_from_world;
      frame.views.push_back(Photograph(surface, shot));
      frame.views.back().reference_baseline = before.reference_baseline;
    }
    moving.frames.push_back(std::move(frame));
  }
  return moving;
}

Shot Ahead() { return ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10}); }

osg::ref_ptr<DepthTR> NodeOf(DtrSet set) {
  osg::ref_ptr<DepthTR> node = new DepthTR;
  node->setScene(std::move(set));
  return node;
}

/// What each time step looks like as a set of its own.
std::vector<ImageRgb8> Alone() {
  std::vector<ImageRgb8> pictures;
  for (DtrSet& still : SplitFrames(MovingSquare())) {
    const osg::ref_ptr<DepthTR> node = NodeOf(std::move(still));
    OffscreenViewer viewer(node.get(), Ahead().camera, Ahead().cam_from_world);
    pictures.push_back(viewer.Draw().image);
  }
  return pictures;
}

class TimeStepsTest : public OsgTest {};

TEST_F(TimeStepsTest, EachIsShownAsASetOfItsOwnWouldBe) {
  const std::vector<ImageRgb8> alone = Alone();
  ASSERT_EQ(alone.size(), 3U);
  EXPECT_NE(alone[0], alone[1]);
  EXPECT_NE(alone[1], alone[2]);
  const osg::ref_ptr<DepthTR> node = NodeOf(MovingSquare());
  EXPECT_EQ(node->numberOfTimeSteps(), 3);
  EXPECT_EQ(node->getTimeStepTime(2), 2 * kStep);
  OffscreenViewer viewer(node.get(), Ahead().camera, Ahead().cam_from_world);
  for (const int time_step : {0, 2, 1, 0}) {
    node->setTimeStep(time_step);
    EXPECT_EQ(node->getTimeStep(), time_step);
    EXPECT_EQ(viewer.Draw().image, alone[static_cast<size_t>(time_step)]) << time_step;
    EXPECT_EQ(&node->inputViews()[0].view(), node->getScene()->scene.views[0]);
  }
  EXPECT_THROW(node->setTimeStep(3), UsageError);
  EXPECT_THROW(node->setTimeStep(-1), UsageError);
}

TEST_F(TimeStepsTest, TheBoundHoldsAllOfThem) {
  const osg::ref_ptr<DepthTR> node = NodeOf(MovingSquare());
  const osg::BoundingBox bounds = node->getDtrDrawable()->getBoundingBox();
  for (int time_step = 0; time_step < 3; ++time_step) {
    node->setTimeStep(time_step);
    for (const osgDTR::InputView& view : node->inputViews()) {
      for (const osg::Vec3f& point : view.get3D()) {
        if (point == osg::Vec3f()) continue;
        ASSERT_TRUE(bounds.contains(point));
      }
    }
  }
}

TEST_F(TimeStepsTest, PlayingFollowsTheViewersTime) {
  const std::vector<ImageRgb8> alone = Alone();
  for (const Threading threading :
       {Threading::SingleThreaded, Threading::CullThreadPerCameraDrawThreadPerContext}) {
    const osg::ref_ptr<DepthTR> node = NodeOf(MovingSquare());
    osg::ref_ptr<osg::MatrixTransform> above = new osg::MatrixTransform;
    above->addChild(node);
    OffscreenViewer viewer(above.get(), Ahead().camera, Ahead().cam_from_world, threading);
    EXPECT_EQ(viewer.DrawAt(99).image, alone[0]);
    node->setTimeStep(1);
    node->setPlaying(true);  // from time step 1 on, whatever the time is now
    const std::pair<double, size_t> expected[] = {{100.0, 1}, {100.4, 1}, {100.6, 2},
                                                  {101.1, 0}, {101.6, 1}, {103.2, 1}};
    for (const auto& [time_s, time_step] : expected) {
      EXPECT_EQ(viewer.DrawAt(time_s).image, alone[time_step]) << time_s;
      EXPECT_EQ(node->getTimeStep(), static_cast<int>(time_step)) << time_s;
    }
    node->setPlaying(false);
    EXPECT_EQ(viewer.DrawAt(104.2).image, alone[1]) << "it stands still";
    node->setPlaying(true);
    EXPECT_EQ(viewer.DrawAt(200).image, alone[1]) << "and goes on from there";
    EXPECT_EQ(viewer.DrawAt(200.5).image, alone[2]);
  }
}

/// What a handler asks of a viewer.
class NoViewer : public osgGA::GUIActionAdapter {
 public:
  void requestRedraw() override {}
  void requestContinuousUpdate(bool) override {}
  void requestWarpPointer(float, float) override {}
};

bool Press(osgDTR::KeyHandler& handler, int key) {
  const osg::ref_ptr<osgGA::GUIEventAdapter> event = new osgGA::GUIEventAdapter;
  event->setEventType(osgGA::GUIEventAdapter::KEYDOWN);
  event->setKey(key);
  NoViewer viewer;
  return handler.handle(*event, viewer);
}

TEST(TimeSteps, AHostsClockChoosesTheTimeStep) {
  const osg::ref_ptr<DepthTR> node = NodeOf(MovingSquare());
  const double second = node->getTimeStepTime(1);
  node->setTime(second + 1e-6);
  EXPECT_EQ(node->getTimeStep(), 1);
  node->setTime(second - 1e-6);
  EXPECT_EQ(node->getTimeStep(), 0);
  EXPECT_THROW(node->setTime(std::numeric_limits<double>::quiet_NaN()), UsageError);
  EXPECT_EQ(node->getTimeStep(), 0);
}

TEST(TimeStepKeys, StepAndPlay) {
  const osg::ref_ptr<DepthTR> node = NodeOf(MovingSquare());
  const osg::ref_ptr<osgDTR::KeyHandler> handler = new osgDTR::KeyHandler(node.get());
  EXPECT_TRUE(Press(*handler, '.'));
  EXPECT_EQ(node->getTimeStep(), 1);
  EXPECT_TRUE(Press(*handler, ','));
  EXPECT_TRUE(Press(*handler, ','));
  EXPECT_EQ(node->getTimeStep(), 2);
  EXPECT_TRUE(Press(*handler, 'j'));
  EXPECT_TRUE(node->isPlaying());
  EXPECT_TRUE(Press(*handler, '.'));
  EXPECT_FALSE(node->isPlaying()) << "a step by hand stops it";
}

TEST(TimeStepKeys, MeanNothingToAStillScene) {
  const osg::ref_ptr<DepthTR> node = NodeOf(SquareBeforePlane());
  const osg::ref_ptr<osgDTR::KeyHandler> handler = new osgDTR::KeyHandler(node.get());
  EXPECT_EQ(node->numberOfTimeSteps(), 1);
  for (const int key : {',', '.', 'j'}) EXPECT_FALSE(Press(*handler, key));
}

TEST(TimeSteps, ACopyIsAtTheSameTimeStepAndPlaysByItself) {
  const osg::ref_ptr<DepthTR> node = NodeOf(MovingSquare());
  node->setTimeStep(2);
  const osg::ref_ptr<DepthTR> copy = osg::clone(node.get(), osg::CopyOp::DEEP_COPY_ALL);
  EXPECT_EQ(copy->getTimeStep(), 2);
  EXPECT_EQ(copy->getScene(), node->getScene());
  copy->setTimeStep(0);
  EXPECT_EQ(node->getTimeStep(), 2);
}

}  // namespace
}  // namespace dtr::testing
