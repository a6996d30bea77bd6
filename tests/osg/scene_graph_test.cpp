// DepthTR as a citizen of the scene graph: whatever stands above it, beside it, and draws it.
#include "tests/gl/gl_testing.h"
// clang-format keeps this group apart.
#include <osg/Geometry>
#include <osg/LOD>
#include <osg/MatrixTransform>
#include <osg/PositionAttitudeTransform>
#include <osg/ShapeDrawable>
#include <osg/Switch>
#include <osg/Texture2D>
#include <osgViewer/CompositeViewer>

#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;
using Threading = osgViewer::ViewerBase::ThreadingModel;

osg::ref_ptr<DepthTR> SquareNode() {
  osg::ref_ptr<DepthTR> node = new DepthTR;
  node->setScene(SquareBeforePlane());
  return node;
}

Shot Ahead() { return ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10}); }

Shown Draw(osg::Node* scene, const Shot& novel = Ahead()) {
  OffscreenViewer viewer(scene, novel.camera, novel.cam_from_world);
  return viewer.Draw();
}

int Differing(const Shown& a, const Shown& b) {
  int count = 0;
  for (int y = 0; y < a.image.height(); ++y) {
    for (int x = 0; x < a.image.width(); ++x) count += PixelDifference(a.image, b.image, x, y) > 0;
  }
  return count;
}

int Drawn(const Shown& shown) {
  return static_cast<int>(std::count_if(shown.depth.data().begin(), shown.depth.data().end(),
                                        [](float z) { return z < 1; }));
}

// A matrix and its inverse leave this of a camera, and a pixel in a thousand may fall elsewhere.
constexpr double kMovedShare = 2e-3;

class SceneGraphTest : public OsgTest {};

TEST_F(SceneGraphTest, MovesTurnsAndGrowsWithWhatStandsAboveIt) {
  const Shown alone = Draw(SquareNode().get());
  ASSERT_GT(Drawn(alone), 1000);
  const osg::Quat turn(0.4, osg::Vec3d(0.2, 0.5, -0.7));
  osg::ref_ptr<osg::PositionAttitudeTransform> placed = new osg::PositionAttitudeTransform;
  placed->setAttitude(turn);
  placed->setPosition({3, -4, 5});
  placed->setScale({2.5, 2.5, 2.5});
  placed->addChild(SquareNode());
  osg::Matrixd world_from_local;
  placed->computeLocalToWorldMatrix(world_from_local, nullptr);
  const Shot novel = Ahead();
  OffscreenViewer viewer(placed.get(), novel.camera, {});
  viewer.viewer.getCamera()->setViewMatrix(osg::Matrixd::inverse(world_from_local) *
                                           osgDTR::ViewMatrixOf(novel.cam_from_world) *
                                           osg::Matrixd::scale(2.5, 2.5, 2.5));
  EXPECT_LE(Differing(viewer.Draw(), alone), kMovedShare * Drawn(alone));
}

TEST_F(SceneGraphTest, UnevenScalesAndMirrorsAreRefusedNotShownWrong) {
  for (const osg::Vec3d& scale : {osg::Vec3d(1, 2, 1), osg::Vec3d(-1, 1, 1)}) {
    osg::ref_ptr<osg::MatrixTransform> above = new osg::MatrixTransform(osg::Matrixd::scale(scale));
    above->addChild(SquareNode());
    EXPECT_EQ(Drawn(Draw(above.get())), 0);
  }
}

TEST_F(SceneGraphTest, SwitchesAndLevelsOfDetailDecideWhetherItIsDrawn) {
  osg::ref_ptr<osg::Switch> on_off = new osg::Switch;
  on_off->addChild(SquareNode());
  const int drawn = Drawn(Draw(on_off.get()));
  EXPECT_GT(drawn, 1000);
  on_off->setAllChildrenOff();
  EXPECT_EQ(Drawn(Draw(on_off.get())), 0);
  osg::ref_ptr<osg::LOD> levels = new osg::LOD;
  levels->addChild(SquareNode(), 0, 100);
  EXPECT_EQ(Drawn(Draw(levels.get())), drawn);
  levels->setRange(0, 1000, 2000);
  EXPECT_EQ(Drawn(Draw(levels.get())), 0);
}

TEST_F(SceneGraphTest, StandsInTwoPlacesAtOnce) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const Shot novel = Ahead();
  // As far behind as nothing of the first is; the second is seen where the first shows nothing.
  osg::ref_ptr<osg::MatrixTransform> beside =
      new osg::MatrixTransform(osg::Matrixd::translate(1.1, 0.4, -0.5));
  beside->addChild(node);
  osg::ref_ptr<osg::Group> both = new osg::Group;
  both->addChild(node);
  both->addChild(beside);
  const Shown first = Draw(node.get()), second = Draw(beside.get()), shown = Draw(both.get());
  int of_first = 0, of_second = 0;
  for (int y = 0; y < shown.image.height(); ++y) {
    for (int x = 0; x < shown.image.width(); ++x) {
      const bool is_first = first.depth(x, y) <= second.depth(x, y);
      const Shown& expected = is_first ? first : second;
      ASSERT_EQ(PixelDifference(shown.image, expected.image, x, y), 0) << x << "," << y;
      ASSERT_EQ(shown.depth(x, y), expected.depth(x, y));
      (is_first ? of_first : of_second) += expected.depth(x, y) < 1;
    }
  }
  EXPECT_GT(of_first, 100);
  EXPECT_GT(of_second, 100);
  EXPECT_EQ(node->getDtrDrawable()->contextCount(), 0U) << "viewers took their renderers with them";
}

TEST_F(SceneGraphTest, IsCulledByABoundThatHoldsAllOfIt) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const osg::BoundingBox bounds = node->getDtrDrawable()->getBoundingBox();
  for (const osgDTR::InputView& view : node->inputViews()) {
    for (const osg::Vec3f& point : view.get3D()) {
      if (point != osg::Vec3f()) {
        ASSERT_TRUE(bounds.contains(point));
      }
    }
  }
  const Shot away = ShotFrom("n", {0, 0, -100}, {0, 0, -200});
  OffscreenViewer viewer(node.get(), away.camera, away.cam_from_world);
  EXPECT_EQ(Drawn(viewer.Draw()), 0);
  EXPECT_EQ(node->getDtrDrawable()->contextCount(), 0U) << "it was drawn though it is behind";
}

TEST_F(SceneGraphTest, NearAndFarPlanesFromItsBoundCutNothingOff) {
  const Shot novel = Ahead();
  const int whole = Drawn(Draw(SquareNode().get()));
  const osg::ref_ptr<DepthTR> node = SquareNode();
  OffscreenViewer viewer(node.get(), novel.camera, novel.cam_from_world);
  viewer.viewer.getCamera()->setComputeNearFarMode(
      osg::CullSettings::COMPUTE_NEAR_FAR_USING_BOUNDING_VOLUMES);
  EXPECT_EQ(Drawn(viewer.Draw()), whole);
}

/// A lit, textured, half transparent ball and a plain one, as models are.
osg::ref_ptr<osg::Node> Models(int count = 2) {
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  for (int i = 0; i < count; ++i) {
    osg::ref_ptr<osg::ShapeDrawable> ball = new osg::ShapeDrawable(
        new osg::Sphere(osg::Vec3(0.8F * static_cast<float>(i) - 0.4F, 0.1F, 3.0F), 0.35F));
    ball->setColor({0.9F, 0.6F, 0.3F, i == 0 ? 1.0F : 0.6F});
    geode->addDrawable(ball);
  }
  osg::ref_ptr<osg::Image> image = new osg::Image;
  image->allocateImage(8, 8, 1, GL_RGB, GL_UNSIGNED_BYTE);
  for (unsigned i = 0; i < 3 * 64; ++i) image->data()[i] = static_cast<unsigned char>(i * 37);
  osg::StateSet* const state = geode->getDrawable(0)->getOrCreateStateSet();
  state->setTextureAttributeAndModes(0, new osg::Texture2D(image));
  if (count > 1) {
    geode->getDrawable(1)->getOrCreateStateSet()->setMode(GL_BLEND, osg::StateAttribute::ON);
  }
  geode->getOrCreateStateSet()->setRenderBinDetails(2, "RenderBin");  // after the scene
  return geode;
}

TEST_F(SceneGraphTest, ModelsDrawnAfterItAreUnchanged) {
  for (const auto path : {osgDTR::DrawPath::kGpu, osgDTR::DrawPath::kReadBack}) {
    osg::ref_ptr<osg::Group> with = new osg::Group;
    const osg::ref_ptr<DepthTR> node = SquareNode();
    node->setDrawPath(path);
    with->addChild(node);
    with->addChild(Models());
    const osg::ref_ptr<osg::Node> models = Models();
    const Shot novel = Ahead();
    OffscreenViewer first(models.get(), novel.camera, novel.cam_from_world);
    const Shown without = first.Draw(3);
    OffscreenViewer second(with.get(), novel.camera, novel.cam_from_world);
    const Shown shown = second.Draw(3);
    const Shown only_opaque = Draw(Models(1).get());
    int opaque = 0, shown_through = 0;
    for (int y = 0; y < shown.image.height(); ++y) {
      for (int x = 0; x < shown.image.width(); ++x) {
        if (!(without.depth(x, y) < 1)) continue;
        EXPECT_EQ(shown.depth(x, y), without.depth(x, y));
        if (only_opaque.depth(x, y) == without.depth(x, y)) {
          ++opaque;
          ASSERT_EQ(PixelDifference(shown.image, without.image, x, y), 0) << x << "," << y;
        } else {
          shown_through += PixelDifference(shown.image, without.image, x, y) > 0;
        }
      }
    }
    EXPECT_GT(opaque, 100);
    EXPECT_GT(shown_through, 100) << "the scene behind the half transparent ball is not seen";
  }
}

TEST_F(SceneGraphTest, TheReportsReadBackPathShowsTheTwoPassPicture) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  node->setMode(osgDTR::TRIANGULATION);
  const Shown gpu = Draw(node.get());
  node->setDrawPath(osgDTR::DrawPath::kReadBack);
  const Shown read_back = Draw(node.get());
  int beyond = 0;
  for (int y = 0; y < gpu.image.height(); ++y) {
    for (int x = 0; x < gpu.image.width(); ++x) {
      // Each view's colours were rounded to 8 bits before they were blended.
      beyond += PixelDifference(gpu.image, read_back.image, x, y) > 2;
    }
  }
  EXPECT_GT(Drawn(gpu), 1000);
  EXPECT_LT(beyond, kMovedShare * Drawn(gpu));
}

/// Changes what may change while other threads draw.
class ChangeOptions : public osg::NodeCallback {
 public:
  void operator()(osg::Node* node, osg::NodeVisitor* visitor) override {
    auto* const scene = static_cast<DepthTR*>(node);
    RenderOptions options = scene->getRenderOptions();
    options.views = 1 + static_cast<int>(visitor->getTraversalNumber() % 4);
    scene->setRenderOptions(options);
    traverse(node, visitor);
  }
};

struct TwoWindows {
  explicit TwoWindows(osg::Node* scene, Threading threading, bool shared) {
    viewer.setThreadingModel(threading);
    const Shot novel = Ahead();
    const int width = novel.camera.width_px(), height = novel.camera.height_px();
    osg::ref_ptr<osg::GraphicsContext> first;
    for (int i = 0; i < 2; ++i) {
      osg::ref_ptr<osgViewer::View> view = new osgViewer::View;
      osg::ref_ptr<osg::GraphicsContext> context =
          MakePbuffer(width, height, shared ? first.get() : nullptr);
      if (i == 0) first = context;
      osg::Camera* const camera = view->getCamera();
      camera->setGraphicsContext(context);
      camera->setViewport(0, 0, width, height);
      camera->setDrawBuffer(GL_FRONT);
      camera->setReadBuffer(GL_FRONT);
      camera->setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
      camera->setProjectionMatrix(osgDTR::ProjectionMatrixOf(novel.camera, 0.5, 200));
      camera->setViewMatrix(osgDTR::ViewMatrixOf(
          ShotFrom("n", {0.17 - 0.3 * i, 0.11, 0.3}, {0.2, -0.1, 10}).cam_from_world));
      callbacks[i] = new ReadBackCallback(width, height);
      camera->setFinalDrawCallback(callbacks[i]);
      view->setSceneData(scene);
      viewer.addView(view);
      views[i] = view;
    }
  }
  osgViewer::CompositeViewer viewer;
  osg::ref_ptr<osgViewer::View> views[2];
  osg::ref_ptr<ReadBackCallback> callbacks[2];
};

TEST_F(SceneGraphTest, EveryThreadingModelDrawsTheSameInTwoWindows) {
  Shown expected[2];
  for (const bool shared : {false, true}) {
    for (const Threading threading :
         {Threading::SingleThreaded, Threading::CullDrawThreadPerContext,
          Threading::DrawThreadPerContext, Threading::CullThreadPerCameraDrawThreadPerContext}) {
      SCOPED_TRACE(::testing::Message() << "threading " << threading << ", shared " << shared);
      const osg::ref_ptr<DepthTR> node = SquareNode();
      osg::ref_ptr<ChangeOptions> change = new ChangeOptions;
      node->addUpdateCallback(change);
      {
        TwoWindows windows(node.get(), threading, shared);
        for (int i = 0; i < 12; ++i) windows.viewer.frame();
        node->removeUpdateCallback(change);
        node->setRenderOptions({});
        for (int i = 0; i < 3; ++i) windows.viewer.frame();
        windows.viewer.stopThreading();
        EXPECT_EQ(node->getDtrDrawable()->contextCount(), 2U);
        for (int i = 0; i < 2; ++i) {
          const Shown& shown = windows.callbacks[i]->shown();
          if (expected[i].image.empty()) expected[i] = shown;
          EXPECT_GT(Drawn(shown), 1000);
          EXPECT_EQ(shown.image, expected[i].image);
          EXPECT_EQ(shown.depth, expected[i].depth);
        }
      }
      EXPECT_EQ(node->getDtrDrawable()->contextCount(), 0U);
    }
  }
  EXPECT_NE(expected[0].image, expected[1].image);
}

TEST_F(SceneGraphTest, OneWindowClosesAndTheOtherGoesOn) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  TwoWindows windows(node.get(), Threading::SingleThreaded, false);
  windows.viewer.frame();
  const Shown before = windows.callbacks[1]->shown();
  windows.views[0]->getCamera()->getGraphicsContext()->close();
  windows.viewer.removeView(windows.views[0]);
  windows.viewer.frame();
  EXPECT_EQ(node->getDtrDrawable()->contextCount(), 1U);
  EXPECT_EQ(windows.callbacks[1]->shown().image, before.image);
}

TEST_F(SceneGraphTest, AnotherSetTakesThePlaceOfTheFirst) {
  const osg::ref_ptr<DepthTR> node = SquareNode();
  const Shot novel = Ahead();
  OffscreenViewer viewer(node.get(), novel.camera, novel.cam_from_world);
  const Shown first = viewer.Draw();
  DtrSet darker = SquareBeforePlane();
  for (View& view : darker.frames[0].views) view.gain *= 0.3;
  node->setScene(std::move(darker));
  const Shown second = viewer.Draw();
  EXPECT_EQ(Drawn(first), Drawn(second));
  EXPECT_GT(Differing(first, second), Drawn(first) / 2);
}

}  // namespace
}  // namespace dtr::testing
