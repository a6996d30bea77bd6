// dtr/gl/frame_timer.h -- how long OpenGL takes for a frame; no GL header is needed to use it.
#pragma once
#include <functional>
#include <memory>
#include <optional>

namespace dtr::gl {

/// Times what is drawn with the current context, to which it belongs.
class FrameTimer {
 public:
  /// With the GPU's clock where it is worth something (has_gpu_clock).
  FrameTimer();
  /// With it or without, whatever the driver is.
  explicit FrameTimer(bool gpu_clock);
  ~FrameTimer();
  FrameTimer(const FrameTimer&) = delete;
  FrameTimer& operator=(const FrameTimer&) = delete;

  /// By default false for software rasterisers (by GL_RENDERER): their timer queries count the
  /// queueing of commands and next to nothing of the work, which the processor's threads do.
  bool has_gpu_clock() const { return queries_ != nullptr; }

  /// Waits until the GPU is idle, calls `draw` and waits until that is finished. Milliseconds of
  /// the GPU's own clock (GL_TIME_ELAPSED), none without one. Passes on what `draw` throws.
  std::optional<double> GpuMilliseconds(const std::function<void()>& draw);

 private:
  struct Queries;
  std::unique_ptr<Queries> queries_;
};

/// glFinish: returns when all that was asked of the current context is done.
void WaitForGpu();

}  // namespace dtr::gl
