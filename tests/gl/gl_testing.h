// tests/gl/gl_testing.h -- a context for the tests, and scenes.
#pragma once
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "dtr/gl/context.h"
#include "dtr/gl/fitting_renderer.h"
#include "dtr/gl/renderer.h"
#include "tests/cpu/render_testing.h"
#include "tests/simd/parity_scenes.h"

namespace dtr::testing {

/// One context for all tests of a program, with debug output; null where the machine has none.
inline gl::EglContext* SharedContext(std::string* why) {
  static std::string reason;
  static std::unique_ptr<gl::EglContext> context = [] {
    try {
      return std::make_unique<gl::EglContext>();
    } catch (const std::exception& error) {
      reason = error.what();
      return std::unique_ptr<gl::EglContext>();
    }
  }();
  *why = reason;
  return context.get();
}

/// Skips where there is no OpenGL; any error the driver reports fails the test.
class GlTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (SharedContext(&why) == nullptr) GTEST_SKIP() << why;
    debug_ = std::make_unique<gl::DebugOutput>();
  }
  void TearDown() override {
    if (debug_) {
      EXPECT_EQ(debug_->errors(), 0);
    }
    debug_.reset();
  }

 private:
  std::unique_ptr<gl::DebugOutput> debug_;
};

}  // namespace dtr::testing
