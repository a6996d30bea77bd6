// DepthTR as a citizen of the scene graph: whatever stands above it, beside it, and draws it.
#include "tests/gl/gl_testing.h"
// clang-format keeps this group apart.
#include <osg/Geometry>
#include <osg/LOD>
#include <osg/MatrixTransform>
#include <osg/PositionAttitudeTransform>
#include <osg/Program>
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

TEST_F(SceneGraphTest, UnevenScalesAndMirrorsAreRejectedNotShownWrong) {
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

// OpenSceneGraph puts the near plane 1/2000 as far away as the far plane.
TEST_F(SceneGraphTest, OneDepthThatIsFarTooLargeClipsNoForeground) {
  const Shot novel = Ahead();
  const auto shown = [&](bool spoiled) {
    DtrSet set = SquareBeforePlane();
    if (spoiled) set.frames[0].views[0].depth(3, 3) = 1e5F;
    osg::ref_ptr<DepthTR> node = new DepthTR;
    node->setScene(std::move(set));
    osg::ref_ptr<osg::Group> both = new osg::Group;
    both->addChild(node);
    both->addChild(RedBox({0, 0, 3}, {0.2, 0.2, 0.2}));
    OffscreenViewer viewer(both.get(), novel.camera, novel.cam_from_world);
    viewer.viewer.getCamera()->setComputeNearFarMode(
        osg::CullSettings::COMPUTE_NEAR_FAR_USING_BOUNDING_VOLUMES);
    return viewer.Draw();
  };
  const auto red = [](const Shown& picture) {
    int count = 0;
    for (int y = 0; y < picture.image.height(); ++y) {
      for (int x = 0; x < picture.image.width(); ++x) count += IsRed(picture.image, x, y);
    }
    return count;
  };
  const Shown good = shown(false), spoiled = shown(true);
  ASSERT_GT(red(good), 100);
  EXPECT_EQ(red(spoiled), red(good));
  constexpr int kOfThePixel =
      40;  // and of the triangles around it, in all views that see the place
  EXPECT_NEAR(Drawn(spoiled), Drawn(good), kOfThePixel);
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

/// A square as programs of today draw it: vertex buffers, an attribute of its own, shaders with a
/// uniform and a texture in another unit than the first.
osg::ref_ptr<osg::Node> ShaderModel() {
  osg::ref_ptr<osg::Geometry> square = new osg::Geometry;
  square->setUseDisplayList(false);
  square->setUseVertexBufferObjects(true);
  osg::ref_ptr<osg::Vec3Array> corners = new osg::Vec3Array;
  osg::ref_ptr<osg::Vec2Array> places = new osg::Vec2Array;
  for (const float y : {-0.9F, -0.3F}) {
    for (const float x : {-0.5F, 0.5F}) {
      corners->push_back({x, y, 2.8F});
      places->push_back({x + 0.5F, (y + 0.9F) / 0.6F});
    }
  }
  constexpr unsigned kAttribute = 6, kUnit = 3;
  square->setVertexArray(corners);
  square->setVertexAttribArray(kAttribute, places, osg::Array::BIND_PER_VERTEX);
  square->addPrimitiveSet(new osg::DrawArrays(GL_TRIANGLE_STRIP, 0, 4));
  osg::ref_ptr<osg::Image> image = new osg::Image;
  image->allocateImage(4, 4, 1, GL_RGB, GL_UNSIGNED_BYTE);
  for (unsigned i = 0; i < 3 * 16; ++i) image->data()[i] = static_cast<unsigned char>(i * 53);
  osg::ref_ptr<osg::Texture2D> texture = new osg::Texture2D(image);
  texture->setFilter(osg::Texture::MIN_FILTER, osg::Texture::NEAREST);
  texture->setFilter(osg::Texture::MAG_FILTER, osg::Texture::NEAREST);
  osg::ref_ptr<osg::Program> program = new osg::Program;
  program->addShader(
      new osg::Shader(osg::Shader::VERTEX,
                      "#version 120\nattribute vec2 position; varying vec2 at;\n"
                      "void main() { at = position; gl_Position = ftransform(); }\n"));
  program->addShader(new osg::Shader(
      osg::Shader::FRAGMENT,
      "#version 120\nuniform sampler2D image; uniform vec3 tint; varying vec2 at;\n"
      "void main() { gl_FragColor = vec4(tint * texture2D(image, at).rgb, 1.0); }\n"));
  program->addBindAttribLocation("place", kAttribute);
  osg::StateSet* const state = square->getOrCreateStateSet();
  state->setAttributeAndModes(program);
  state->setTextureAttributeAndModes(kUnit, texture);
  state->addUniform(new osg::Uniform("picture", static_cast<int>(kUnit)));
  state->addUniform(new osg::Uniform("tint", osg::Vec3(1.0F, 0.7F, 0.4F)));
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  geode->addDrawable(square);
  return geode;
}

/// Every way through a frame.
std::vector<osg::ref_ptr<DepthTR>> NodesOfAllPaths() {
  std::vector<osg::ref_ptr<DepthTR>> nodes;
  for (int i = 0; i < 5; ++i) nodes.push_back(SquareNode());
  nodes[1]->setMode(osgDTR::TRIANGULATION);
  nodes[2]->setMode(osgDTR::SPLATTING);
  RenderOptions filled;
  filled.fill_holes = true;
  nodes[3]->setRenderOptions(filled);
  nodes[4]->setDrawPath(osgDTR::DrawPath::kReadBack);
  return nodes;
}

TEST_F(SceneGraphTest, AShaderModelDrawnAfterItIsUnchangedWhateverItsPath) {
  const Shot novel = Ahead();
  const auto draw = [&](const std::vector<osg::ref_ptr<osg::Node>>& nodes) {
    osg::ref_ptr<osg::Group> all = new osg::Group;
    for (const auto& node : nodes) all->addChild(node);
    OffscreenViewer viewer(all.get(), novel.camera, novel.cam_from_world);
    return viewer.Draw(3);
  };
  const auto model = [] {
    const osg::ref_ptr<osg::Node> shaders = ShaderModel();
    shaders->getOrCreateStateSet()->setRenderBinDetails(2, "RenderBin");  // after the scene
    return shaders;
  };
  const Shown without = draw({model()});
  ASSERT_GT(Drawn(without), 500);
  int path = 0;
  for (const osg::ref_ptr<DepthTR>& node : NodesOfAllPaths()) {
    SCOPED_TRACE(path++);
    const Shown shown = draw({node, model()});
    EXPECT_GT(Drawn(shown), Drawn(without) + 1000);
    int differing = 0;
    for (int y = 0; y < shown.image.height(); ++y) {
      for (int x = 0; x < shown.image.width(); ++x) {
        if (!(without.depth(x, y) < 1)) continue;
        differing += PixelDifference(shown.image, without.image, x, y) > 0 ||
                     shown.depth(x, y) != without.depth(x, y);
      }
    }
    EXPECT_EQ(differing, 0);
  }
}

TEST_F(SceneGraphTest, ModelsDrawnAfterItAreUnchanged) {
  for (const osg::ref_ptr<DepthTR>& node : NodesOfAllPaths()) {
    osg::ref_ptr<osg::Group> with = new osg::Group;
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
