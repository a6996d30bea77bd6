#include "dtr/gl/frame_timer.h"

#include <epoxy/gl.h>

#include "dtr/gl/driver.h"

namespace dtr::gl {
namespace {

/// An elapsed-time query that ends with the scope, however that is left: a context allows one only.
class Elapsed {
 public:
  explicit Elapsed(GLuint query) { glBeginQuery(GL_TIME_ELAPSED, query); }
  ~Elapsed() { glEndQuery(GL_TIME_ELAPSED); }
  Elapsed(const Elapsed&) = delete;
  Elapsed& operator=(const Elapsed&) = delete;
};

}  // namespace

struct FrameTimer::Queries {
  GLuint elapsed = 0;
  Queries() { glGenQueries(1, &elapsed); }
  ~Queries() { glDeleteQueries(1, &elapsed); }
};

FrameTimer::FrameTimer() : FrameTimer(!DrawsOnProcessor()) {}
FrameTimer::FrameTimer(bool gpu_clock)
    : queries_(gpu_clock ? std::make_unique<Queries>() : nullptr) {}
FrameTimer::~FrameTimer() = default;

std::optional<double> FrameTimer::GpuMilliseconds(const std::function<void()>& draw) {
  glFinish();
  if (!queries_) {
    draw();
    glFinish();
    return std::nullopt;
  }
  {
    const Elapsed elapsed(queries_->elapsed);
    draw();
  }
  GLuint64 nanoseconds = 0;
  glGetQueryObjectui64v(queries_->elapsed, GL_QUERY_RESULT, &nanoseconds);  // waits
  glFinish();
  return 1e-6 * static_cast<double>(nanoseconds);
}

void WaitForGpu() { glFinish(); }

}  // namespace dtr::gl
