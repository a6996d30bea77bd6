#include "viewer/glfw/run_figures.h"

namespace dtr::viewer {

void RunFigures::Moved(int divisor, double ms, double cpu_ms) {
  for (FrameTimes* times : {&report_.moving, &report_.moving_by_divisor[divisor]}) {
    ++times->frames;
    times->ms += ms;
    times->cpu_ms += cpu_ms;
  }
}

void RunFigures::EndFrame(bool any, bool whole) {
  ++report_.last.frames;
  if (report_.last.frames % AppReport::kFramesPerSample == 0) {
    report_.memory_bytes.push_back(MemoryBytes());
  }
  if (any || whole) TimeUnlessTimed(report_.first_frame_ms, report_.first_frame_cpu_ms);
  if (whole) TimeUnlessTimed(report_.first_whole_frame_ms, report_.first_whole_frame_cpu_ms);
}

void RunFigures::TimeUnlessTimed(double& ms, double& cpu_ms) const {
  if (ms > 0) return;
  ms = 1e3 * started_.seconds();
  cpu_ms = ProcessCpuMilliseconds() - started_cpu_ms_;
}

}  // namespace dtr::viewer
