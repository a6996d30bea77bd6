// SPEC 5.1 to 6 by shaders and by dtr/simd: one image.
#include <gtest/gtest.h>

#include "dtr/gl/renderer.h"
#include "dtr/simd/renderer.h"
#include "tests/gl/gl_testing.h"

namespace dtr::testing {
namespace {

using CoarseDepthGl = GlTest;

Pose RandomPose(Random& random, double spread) {
  const Eigen::Vector3d centre(random.Uniform(-spread, spread), random.Uniform(-spread, spread),
                               random.Uniform(-spread, spread));
  const Eigen::Vector3d target(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(4, 12));
  return LookAt(centre, target);
}

TEST_F(CoarseDepthGl, ShadersAndVectorInstructionsAgree) {
  const auto scenes = ParityScenes();
  gl::Renderer shaders;
  simd::Renderer processor;
  RenderOptions options;
  options.method = RenderMethod::kDeferred;
  Random random(8);
  long long pixels = 0, apart = 0;
  for (const NamedScene& scene : scenes) {
    const RenderScene views = MakeRenderScene(scene.set);
    for (int i = 0; i < 4; ++i) {
      // The last ones stand among the surfaces: near planes cut, triangles are large.
      const Pose pose = i == 0 ? scene.novel.cam_from_world : RandomPose(random, i < 3 ? 1 : 9);
      const PinholeCamera novel(96, 72, i == 2 ? 900 : 90, i == 2 ? 900 : 90, 48, 36);
      const RenderResult a = shaders.Render(views, novel, pose, options);
      const RenderResult b = processor.Render(views, novel, pose, options);
      for (int y = 0; y < 72; ++y) {
        for (int x = 0; x < 96; ++x) {
          ++pixels;
          apart +=
              a.coverage(x, y) != b.coverage(x, y) || PixelDifference(a.image, b.image, x, y) > 2;
        }
      }
    }
  }
  // Both round in single precision, in another order: triangles' borders fall either way. Of
  // 165888 pixels 20 were apart.
  constexpr double kLargestShare = 5e-4;
  EXPECT_LE(static_cast<double>(apart), kLargestShare * static_cast<double>(pixels));
}

}  // namespace
}  // namespace dtr::testing
