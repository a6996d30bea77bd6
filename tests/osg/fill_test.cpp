// Hole filling among models: the image of dtr/gl, with a depth that models hide by and are hidden
// by.
#include "tests/gl/gl_testing.h"
#include "tests/simd/exact_scenes.h"
// clang-format keeps this group apart.
#include <osg/Group>

#include <algorithm>
#include <chrono>
#include <thread>

#include "dtr/io/image_io.h"
#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"
#include "viewer/stillness.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;

RenderOptions Filled(RenderMethod method = RenderMethod::kDeferred) {
  RenderOptions options;
  options.method = method;
  options.fill_holes = true;
  return options;
}

/// An image as dtr/gl draws it, in a context of its own.
RenderResult DrawnAlone(const DtrSet& set, const Shot& novel, const RenderOptions& options) {
  const gl::EglContext context;
  gl::FittingRenderer renderer;
  return renderer.Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
}

/// Of pixels that are not as they should be, in shares of the image.
struct Wrong {
  double colour = 0, empty = 0;
};

Wrong Compare(const Shown& shown, const RenderResult& expected) {
  Wrong wrong;
  const double share = 1.0 / (shown.image.width() * shown.image.height());
  for (int y = 0; y < shown.image.height(); ++y) {
    for (int x = 0; x < shown.image.width(); ++x) {
      if (PixelDifference(shown.image, expected.image, x, y) > 1) wrong.colour += share;
      if (!(shown.depth(x, y) < 1)) wrong.empty += share;
    }
  }
  return wrong;
}

// OpenSceneGraph's matrices turn a camera in the last digits: pixels at outlines change hands, and
// with each of them what is filled from it.
constexpr double kShareOfBorderPixels = 1e-3;

/// From two views, far apart, much of the courtyard is seen by none.
NamedScene WithHoles(int width_px, int height_px) {
  NamedScene named = ExactScene("courtyard", 5, width_px, height_px);
  std::vector<View>& views = named.set.frames[0].views;
  views.erase(views.begin() + 1, views.end() - 1);
  return named;
}

osg::ref_ptr<DepthTR> FilledWhenStill(const DtrSet& set) {
  osg::ref_ptr<DepthTR> node = new DepthTR;
  node->setScene(set);
  node->setRenderOptions(Filled());
  node->setFillTime(osgDTR::FillTime::kWhenStill);
  return node;
}

/// Until what has stopped moving counts as still.
void WaitUntilStill() {
  std::this_thread::sleep_for(std::chrono::duration<double>(1.1 * dtr::viewer::kStillAfterSeconds));
}

class FillTest : public OsgTest {};

TEST_F(FillTest, ShowsWhatTheRendererFillsByItself) {
  const NamedScene named = WithHoles(240, 160);
  for (const RenderMethod method : kBothMethods) {
    const RenderResult expected = DrawnAlone(named.set, named.novel, Filled(method));
    ASSERT_LT(expected.coverage_share, 0.95);
    osg::ref_ptr<DepthTR> node = new DepthTR;
    node->setScene(named.set);
    node->setRenderOptions(Filled(method));
    OffscreenViewer viewer(node.get(), named.novel.camera, named.novel.cam_from_world);
    const Wrong wrong = Compare(viewer.Draw(), expected);
    EXPECT_LT(wrong.colour, kShareOfBorderPixels);
    EXPECT_EQ(wrong.empty, 0) << "filled pixels are drawn beyond the far plane, too";
    node->setRenderOptions(OptionsOf(method));
    EXPECT_GT(Compare(viewer.Draw(), expected).empty, 0.04) << "off again";
  }
}

TEST_F(FillTest, WhenStillMeansNotWhileMovingAndOnceItRests) {
  const NamedScene named = WithHoles(120, 80);
  const osg::ref_ptr<DepthTR> node = FilledWhenStill(named.set);
  OffscreenViewer viewer(node.get(), named.novel.camera, named.novel.cam_from_world);
  const RenderResult expected = DrawnAlone(named.set, named.novel, Filled(RenderMethod::kDeferred));
  EXPECT_EQ(Compare(viewer.Draw(), expected).empty, 0) << "the first image waits for nothing";
  Pose aside = named.novel.cam_from_world;
  aside.translation.x() += 0.01;
  viewer.Look(aside);
  EXPECT_GT(Compare(viewer.Draw(), expected).empty, 0.04) << "it moves";
  viewer.Look(named.novel.cam_from_world);
  EXPECT_GT(Compare(viewer.Draw(), expected).empty, 0.04) << "it moved just now";
  WaitUntilStill();
  const Wrong wrong = Compare(viewer.Draw(), expected);
  EXPECT_EQ(wrong.empty, 0) << "it rests";
  EXPECT_LT(wrong.colour, kShareOfBorderPixels);
  viewer.Look(aside);
  node->setFillTime(osgDTR::FillTime::kAlways);
  EXPECT_EQ(Compare(viewer.Draw(), expected).empty, 0) << "of every image";
}

/// Whether a pixel of the window shows nothing.
bool AnyEmpty(const Shown& shown) {
  return std::any_of(shown.depth.data().begin(), shown.depth.data().end(),
                     [](float depth) { return !(depth < 1); });
}

/// Two cameras beside each other in one window, as split screens are made.
TEST_F(FillTest, WhenStillAlsoFillsANodeThatAWindowShowsTwice) {
  const NamedScene named = WithHoles(120, 80);
  const osg::ref_ptr<DepthTR> node = FilledWhenStill(named.set);
  OffscreenViewer viewer(node.get(), named.novel.camera, named.novel.cam_from_world);
  osg::Camera* const left = viewer.viewer.getCamera();
  left->setViewport(0, 0, 60, 80);
  osg::ref_ptr<osg::Camera> right = new osg::Camera;
  right->setGraphicsContext(left->getGraphicsContext());
  right->setViewport(60, 0, 60, 80);
  right->setRenderOrder(osg::Camera::PRE_RENDER);  // the other reads back when both are there
  right->setClearColor(left->getClearColor());
  right->setDrawBuffer(GL_FRONT);
  const osg::Matrixd aside = osg::Matrixd::translate(0.2, 0, 0);
  ASSERT_TRUE(viewer.viewer.addSlave(right.get(), osg::Matrixd(), aside));
  EXPECT_FALSE(AnyEmpty(viewer.Draw())) << "the first images wait for nothing";
  Pose moved = named.novel.cam_from_world;
  moved.translation.x() += 0.01;
  viewer.Look(moved);
  EXPECT_TRUE(AnyEmpty(viewer.Draw())) << "both move";
  EXPECT_TRUE(AnyEmpty(viewer.Draw())) << "they moved just now";
  WaitUntilStill();
  const Shown rests = viewer.Draw();
  EXPECT_FALSE(AnyEmpty(rests)) << "both rest";
  int differing = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 60; ++x) differing += rests.depth(x, y) != rests.depth(x + 60, y);
  }
  EXPECT_GT(differing, 1000) << "each shows what it looks at";
  EXPECT_EQ(viewer.Draw().image.data(), rests.image.data()) << "and goes on to";
}

TEST_F(FillTest, TheReadBackPathFillsToo) {
  const NamedScene named = WithHoles(120, 80);
  const RenderResult expected = DrawnAlone(named.set, named.novel, Filled(RenderMethod::kTwoPass));
  osg::ref_ptr<DepthTR> node = new DepthTR;
  node->setScene(named.set);
  node->setRenderOptions(Filled(RenderMethod::kTwoPass));
  node->setDrawPath(osgDTR::DrawPath::kReadBack);
  OffscreenViewer viewer(node.get(), named.novel.camera, named.novel.cam_from_world);
  const Shown& shown = viewer.Draw();
  EXPECT_EQ(Compare(shown, expected).empty, 0);
  double sum = 0;
  for (size_t i = 0; i < shown.image.data().size(); ++i) {
    sum += std::abs(shown.image.data()[i] - expected.image.data()[i]);
  }
  // Each view's colours were rounded before they were blended.
  EXPECT_LT(sum / static_cast<double>(shown.image.data().size()), 1);
}

/// The strip of the plane z = 10 that the square at z = 5 hides from both of the set's views and
/// not from the novel camera: to the right of the square.
struct Strip {
  DtrSet set = SquareBeforePlane();
  Shot novel = ShotFrom("n", {0.8, 0.1, 0}, {0.8, 0.1, 10});
  RenderResult drawn;
  Strip() {
    set.frames[0].views.resize(2);
    drawn = DrawnAlone(set, novel, {});
  }
};

/// Whether some pixel close to it was seen.
bool AtRim(const RenderResult& drawn, int x, int y) {
  constexpr int kEdgePx = 2;  // as in hybrid_test.cpp
  for (int j = -kEdgePx; j <= kEdgePx; ++j) {
    for (int i = -kEdgePx; i <= kEdgePx; ++i) {
      if (drawn.coverage.Contains(x + i, y + j) && drawn.coverage(x + i, y + j) != 0) return true;
    }
  }
  return false;
}

/// Pixels that no view saw and whose rays meet the box; how many of them show it.
struct AtBox {
  int of_strip = 0, red = 0;
};

AtBox Look(const Strip& strip, const Eigen::Vector3d& center, const Eigen::Vector3d& half,
           bool filled) {
  osg::ref_ptr<DepthTR> node = new DepthTR;
  node->setScene(strip.set);
  RenderOptions options;
  options.fill_holes = filled;
  node->setRenderOptions(options);
  osg::ref_ptr<osg::Group> both = new osg::Group;
  both->addChild(node);
  both->addChild(RedBox(center, half));
  const Shown alone =
      OffscreenViewer(RedBox(center, half).get(), strip.novel.camera, strip.novel.cam_from_world)
          .Draw();
  const Shown shown =
      OffscreenViewer(both.get(), strip.novel.camera, strip.novel.cam_from_world).Draw();
  AtBox at;
  for (int y = 0; y < shown.image.height(); ++y) {
    for (int x = 0; x < shown.image.width(); ++x) {
      if (AtRim(strip.drawn, x, y) || !IsRed(alone.image, x, y)) continue;
      ++at.of_strip;
      at.red += IsRed(shown.image, x, y);
    }
  }
  return at;
}

TEST_F(FillTest, FilledPixelsHideWhatIsBehindTheBackgroundAndNothingBeforeTheForeground) {
  const Strip strip;
  ASSERT_LT(strip.drawn.coverage_share, 0.97);
  for (const bool filled : {false, true}) {
    SCOPED_TRACE(filled ? "filled" : "with holes");
    const AtBox near = Look(strip, {1.211, 0.1, 4}, {0.23, 0.23, 0.23}, filled);
    const AtBox far = Look(strip, {2.27, 0.1, 14}, {0.6, 0.6, 0.6}, filled);
    EXPECT_GT(near.of_strip, 100);
    EXPECT_EQ(near.red, near.of_strip);
    EXPECT_GT(far.of_strip, 50);
    EXPECT_EQ(far.red, filled ? 0 : far.of_strip);
  }
}

}  // namespace
}  // namespace dtr::testing
