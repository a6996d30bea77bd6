// The short form of `dtr selftest` with OpenGL, where a context opens.
#include <memory>

#include "dtr/gl/context.h"
#include "dtr/gl/renderer.h"
#include "tests/cli/quick_stability.h"

namespace dtr::selftest {
namespace {

/// Members die in reverse order: the context last.
struct OwnContext {
  gl::EglContext context;
  gl::DebugOutput objections;
  gl::Renderer renderer;
};

RenderFunction MakeGl() {
  return [own = std::make_shared<OwnContext>()](
             const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
             const RenderOptions& options) {
    RenderResult result = own->renderer.Render(scene, novel, novel_from_world, options);
    EXPECT_EQ(own->objections.errors(), 0) << "the driver reports errors";
    return result;
  };
}

std::vector<Case> GlCases() {
  const std::vector<NamedRenderer> renderers = {{"gl", MakeGl}};
  return QuickOnes(RenderingCases(renderers));
}

class QuickGlStability : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(, QuickGlStability, ::testing::ValuesIn(GlCases()), TestNameOf);

TEST_P(QuickGlStability, Holds) {
  try {
    const gl::EglContext context;
  } catch (const std::exception& none) {
    GTEST_SKIP() << none.what();
  }
  ExpectHolds(GetParam());
}

}  // namespace
}  // namespace dtr::selftest
