#include "dtr/gl/context.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "dtr/base/error.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/frame_timer.h"
#include "dtr/gl/objects.h"
#include "dtr/gl/program.h"
#include "tests/gl/gl_testing.h"
#include "tests/support/test_data.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;
using Context = GlTest;

constexpr char kNotMesa[] = "only Mesa's drivers can be asked for an older version";

// Makes a context as a fresh process would, with a variable of the environment set.
void OpenWith(const char* variable, const char* value) {
  setenv(variable, value, 1);
  try {
    const EglContext context;
    if (context.Description().find("Mesa") == std::string::npos) throw Error(kNotMesa);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::exit(1);
  }
  std::exit(0);
}

TEST(EglContextDeathTest, AnOlderContextIsRejectedInOneLineThatNamesTheCpuRenderer) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(OpenWith("MESA_GL_VERSION_OVERRIDE", "4.2"), ::testing::ExitedWithCode(1),
              std::string("OpenGL: expected a context of version 4.3 or newer.*`renderer` cpu|") +
                  kNotMesa);
}

TEST(EglContextDeathTest, AMachineWithoutADriverIsRejectedInOneLineThatNamesTheCpuRenderer) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(OpenWith("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent"),
              ::testing::ExitedWithCode(1),
              "OpenGL: expected a context of version 4.3 or newer.*`renderer` cpu");
}

// What GlTest relies on: a call that the driver objects to does not pass unseen.
TEST_F(Context, DebugOutputCountsWhatTheDriverObjectsTo) {
  const DebugOutput output;
  EXPECT_EQ(output.errors(), 0);
  glEnable(GL_TEXTURE_WRAP_S);  // no capability
  EXPECT_EQ(output.errors(), 1);
  const char* const alarm = "a message of high severity";
  glDebugMessageInsert(GL_DEBUG_SOURCE_APPLICATION, GL_DEBUG_TYPE_PERFORMANCE, 1,
                       GL_DEBUG_SEVERITY_HIGH, -1, alarm);
  EXPECT_EQ(output.errors(), 2);
  glDebugMessageInsert(GL_DEBUG_SOURCE_APPLICATION, GL_DEBUG_TYPE_PERFORMANCE, 1,
                       GL_DEBUG_SEVERITY_LOW, -1, "a hint");
  EXPECT_EQ(output.errors(), 2);
  EXPECT_EQ(glGetError(), GLenum{GL_INVALID_ENUM});
}

#ifndef NDEBUG
TEST_F(Context, IsADebugContextInDevelopmentBuilds) {
  GLint flags = 0;
  glGetIntegerv(GL_CONTEXT_FLAGS, &flags);
  EXPECT_NE(flags & GL_CONTEXT_FLAG_DEBUG_BIT, 0);
}
#endif

TEST_F(Context, FramesOfASoftwareRasteriserHaveNoGpuClock) {
  std::string why;
  FrameTimer timer;
  bool drew = false;
  const auto ms = timer.GpuMilliseconds([&] {
    glFlush();
    drew = true;
  });
  EXPECT_TRUE(drew);
  EXPECT_EQ(ms.has_value(), timer.has_gpu_clock());
  if (SharedContext(&why)->Description().find("llvmpipe") != std::string::npos) {
    EXPECT_FALSE(timer.has_gpu_clock());
  }
}

TEST_F(Context, ATimerWhoseFrameFailsMayTimeTheNextOne) {
  FrameTimer timer(true);
  EXPECT_TRUE(timer.has_gpu_clock());
  EXPECT_THROW(timer.GpuMilliseconds([] { throw Error("no frame"); }), Error);
  GLint open = -1;
  glGetQueryiv(GL_TIME_ELAPSED, GL_CURRENT_QUERY, &open);
  EXPECT_EQ(open, 0);
  EXPECT_TRUE(timer.GpuMilliseconds([] { glFlush(); }).has_value());
}

TEST(Driver, SoftwareRasterisersAreKnownByName) {
  EXPECT_TRUE(IsSoftwareRasteriser("llvmpipe (LLVM 15.0.6, 256 bits)"));
  EXPECT_TRUE(IsSoftwareRasteriser("softpipe"));
  EXPECT_TRUE(IsSoftwareRasteriser("Gallium 0.4 on SWR (LLVM 8.0, 256 bits)"));
  EXPECT_TRUE(IsSoftwareRasteriser("ANGLE (Google, Vulkan (SwiftShader Device), SwiftShader)"));
  EXPECT_FALSE(IsSoftwareRasteriser("NVIDIA H200/PCIe/SSE2"));
  EXPECT_FALSE(IsSoftwareRasteriser("Mesa Intel(R) UHD Graphics 620 (KBL GT2)"));
  EXPECT_FALSE(IsSoftwareRasteriser(""));
}

TEST_F(Context, SaysWhatItIs) {
  std::string why;
  EXPECT_NE(SharedContext(&why)->Description().find("OpenGL 4."), std::string::npos);
}

TEST_F(Context, AShaderThatDoesNotCompileIsNamedWithItsLine) {
  const TemporaryFolder folder;
  std::ofstream(folder / "shared.glsl")
      << "float One() { return 1.0; }\nfloat Two() { retrun 2.0; }\n";
  std::ofstream(folder / "a.vert")
      << "// one\n#include \"shared.glsl\"\nvoid main() { gl_Position = vec4(Two()); }\n";
  try {
    BuildProgram({{GL_VERTEX_SHADER, "a.vert"}}, {}, folder.path().string());
    FAIL() << "it compiled";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("shared.glsl:2"), std::string::npos) << error.what();
  }
  std::ofstream(folder / "shared.glsl") << "float Two() { return 2.0; }\n";
  std::ofstream(folder / "a.vert")
      << "// one\n#include \"shared.glsl\"\n\nvoid main() { gl_Position = Nothing(); }\n";
  try {
    BuildProgram({{GL_VERTEX_SHADER, "a.vert"}}, {}, folder.path().string());
    FAIL() << "it compiled";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("a.vert:4"), std::string::npos) << error.what();
  }
  EXPECT_THROW(BuildProgram({{GL_VERTEX_SHADER, "absent.vert"}}, {}, ""), Error);
}

TEST_F(Context, EveryEmbeddedShaderSaysWhichStepItIs) {
  EXPECT_EQ(EmbeddedShaders().size(), 15u);
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    EXPECT_FALSE(shader.text.empty()) << shader.name;
  }
}

}  // namespace
}  // namespace dtr::gl
