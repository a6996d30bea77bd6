// viewer/glfw/run_figures.h -- what a run of the viewer measures of itself, frame by frame.
#pragma once
#include "dtr/base/machine.h"
#include "viewer/glfw/app.h"
#include "viewer/stillness.h"

namespace dtr::viewer {

/// Fills an AppReport while the viewer runs. Time begins when this is made.
class RunFigures {
 public:
  /// A frame that drew a moving image, of 1/`divisor` of the window per side.
  void Moved(int divisor, double ms, double cpu_ms);
  /// A frame was presented. `any`: its image has something of the set; `whole`: all of it.
  void EndFrame(bool any, bool whole);
  int frames() const { return report_.last.frames; }
  const AppReport& report() const { return report_; }

 private:
  void TimeUnlessTimed(double& ms, double& cpu_ms) const;

  const Stopwatch started_{};
  const double started_cpu_ms_ = ProcessCpuMilliseconds();
  AppReport report_;
};

}  // namespace dtr::viewer
