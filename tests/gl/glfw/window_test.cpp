#include "dtr/gl/glfw/window.h"

#include <cstdio>
#include <cstdlib>

#include "dtr/base/error.h"
#include "tests/gl/gl_testing.h"
#include "tests/support/virtual_display.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;

// Opens a window as a fresh process would, without any display to open it on.
void OpenWithoutDisplay() {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  try {
    const Window window;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::exit(1);
  }
  std::exit(0);
}

TEST(WindowDeathTest, WithoutADisplayIsRejectedInOneLine) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(OpenWithoutDisplay(), ::testing::ExitedWithCode(1),
              "window: expected a display to open it on, found none");
}

class WindowTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!display_.up()) GTEST_SKIP() << "no display: Xvfb is missing or did not come up";
  }

 private:
  VirtualDisplay display_;
};

TEST_F(WindowTest, DrawsWhatAContextWithoutAWindowDraws) {
  const DtrSet set = SquareBeforePlane();
  const RenderScene scene = MakeRenderScene(set);
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
  const auto render = [&] {
    Renderer renderer;
    return renderer.Render(scene, novel.camera, novel.cam_from_world, {});
  };
  std::string of_window;
  RenderResult in_window;
  {
    WindowOptions hidden;
    hidden.visible = false;
    const Window window(hidden);
    const DebugOutput debug;
    of_window = window.Description();
    EXPECT_NE(of_window.find("OpenGL 4."), std::string::npos) << of_window;
    in_window = render();
    EXPECT_GT(in_window.coverage_share, 0.5);
    EXPECT_EQ(debug.errors(), 0);
  }
  const EglContext context;
  // Two drivers may round differently; one may not.
  if (context.Description() == of_window) ExpectSameBytes(in_window, render());
}

TEST_F(WindowTest, ShowsWhatIsDrawnAndOpensAgain) {
  for (int i = 0; i < 2; ++i) {
    WindowOptions options;
    options.width_px = 200;
    options.height_px = 100;
    Window window(options);
    const DebugOutput debug;
    glClearColor(0.25F, 0.5F, 0.75F, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    GLubyte rgb[4] = {};
    glReadPixels(100, 50, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgb);
    EXPECT_NEAR(rgb[1], 128, 1);
    window.Present();
    EXPECT_FALSE(window.CloseRequested());
    EXPECT_NE(window.handle(), nullptr);
    EXPECT_EQ(debug.errors(), 0);
  }
}

}  // namespace
}  // namespace dtr::gl
