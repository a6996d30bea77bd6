#include "dtr/gl/frame_timer.h"

#include <epoxy/gl.h>

#include <string_view>

namespace dtr::gl {
namespace {

bool IsSoftware() {
  const GLubyte* text = glGetString(GL_RENDERER);
  const std::string_view renderer = text == nullptr ? "" : reinterpret_cast<const char*>(text);
  for (const std::string_view name : {"llvmpipe", "softpipe", "swr", "SwiftShader"}) {
    if (renderer.find(name) != std::string_view::npos) return true;
  }
  return false;
}

}  // namespace

struct FrameTimer::Queries {
  GLuint elapsed = 0;
  Queries() { glGenQueries(1, &elapsed); }
  ~Queries() { glDeleteQueries(1, &elapsed); }
};

FrameTimer::FrameTimer() : queries_(IsSoftware() ? nullptr : std::make_unique<Queries>()) {}
FrameTimer::~FrameTimer() = default;

std::optional<double> FrameTimer::GpuMilliseconds(const std::function<void()>& draw) {
  glFinish();
  if (!queries_) {
    draw();
    glFinish();
    return std::nullopt;
  }
  glBeginQuery(GL_TIME_ELAPSED, queries_->elapsed);
  draw();
  glEndQuery(GL_TIME_ELAPSED);
  GLuint64 nanoseconds = 0;
  glGetQueryObjectui64v(queries_->elapsed, GL_QUERY_RESULT, &nanoseconds);  // waits
  glFinish();
  return 1e-6 * static_cast<double>(nanoseconds);
}

void WaitForGpu() { glFinish(); }

}  // namespace dtr::gl
