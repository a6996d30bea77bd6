// epoxy's header, in the first of these, must come before OpenSceneGraph's.
#include "tests/gl/gl_testing.h"
#include "tests/simd/exact_scenes.h"
// clang-format keeps this group apart.
#include <osg/Geometry>
#include <osg/MatrixTransform>
#include <osg/PositionAttitudeTransform>
#include <osg/ShapeDrawable>

#include "dtr/cpu/renderer.h"
#include "dtr/gl/renderer.h"
#include "tests/osg/osg_testing.h"
#include "viewer/osg/depth_tr.h"

namespace dtr::testing {
namespace {

using osgDTR::DepthTR;

constexpr double kShareOfBorderPixels = 2e-4;

/// An image as dtr/gl draws it, in a context of its own.
RenderResult DrawnAlone(const DtrSet& set, const Shot& novel, const RenderOptions& options) {
  const gl::EglContext context;
  gl::FittingRenderer renderer;
  return renderer.Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
}

void ExpectShows(const Shown& shown, const RenderResult& expected, double near_z, double far_z) {
  int wrong_colour = 0, wrong_depth = 0, background = 0;
  for (int y = 0; y < shown.image.height(); ++y) {
    for (int x = 0; x < shown.image.width(); ++x) {
      if (expected.coverage(x, y) == 0) {
        ++background;
        EXPECT_EQ(shown.depth(x, y), 1.0F);
        EXPECT_NEAR(shown.image(x, y, 0), 0.1 * 255, 1);
        EXPECT_NEAR(shown.image(x, y, 2), 0.3 * 255, 1);
        continue;
      }
      if (PixelDifference(shown.image, expected.image, x, y) > 1) ++wrong_colour;
      const double z = expected.depth(x, y);
      const double device =
          (far_z + near_z) / (far_z - near_z) - 2 * far_z * near_z / (far_z - near_z) / z;
      // Half a step of 24 bits, and single precision of 1/z.
      if (std::abs(shown.depth(x, y) - (0.5 * device + 0.5)) > 3e-6) ++wrong_depth;
    }
  }
  const double pixels = shown.image.width() * shown.image.height();
  EXPECT_LT(wrong_colour / pixels, kShareOfBorderPixels);
  EXPECT_LT(wrong_depth / pixels, kShareOfBorderPixels);
  EXPECT_LT(background / pixels, 0.9);
}

class DepthTRTest : public OsgTest {};

TEST_F(DepthTRTest, ShowsWhatTheRendererShowsByItself) {
  const NamedScene named = ExactScene("courtyard", 5, 240, 160);
  for (const RenderMethod method : kBothMethods) {
    osg::ref_ptr<DepthTR> node = new DepthTR;
    node->setScene(named.set);
    node->setRenderOptions(OptionsOf(method));
    OffscreenViewer viewer(node.get(), named.novel.camera, named.novel.cam_from_world);
    const Shown& shown = viewer.Draw();
    ExpectShows(shown, DrawnAlone(named.set, named.novel, OptionsOf(method)),
                OffscreenViewer::kNear, OffscreenViewer::kFar);
  }
}

}  // namespace
}  // namespace dtr::testing
