// dtr/eval/timed_renderer.h -- a renderer whose frames can be timed, and times of many frames.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::eval {

/// What one frame took.
struct FrameTime {
  double wall_ms = 0;
  double cpu_ms = 0;             ///< of the process, all its threads
  std::optional<double> gpu_ms;  ///< by the GPU's own clock; none for a software rasteriser
};

/// Draws frames and times the drawing alone: a frame is finished when its pixels are, wherever they
/// lie; reading them back and filling holes come after.
class TimedRenderer {
 public:
  virtual ~TimedRenderer() = default;
  /// What draws: "llvmpipe (...), OpenGL 4.5 ...".
  virtual std::string Description() const = 0;
  /// True where a GPU's own clock measures frames. Else the pixels are made by the processor, whose
  /// time is what they cost.
  virtual bool HasGpuClock() const = 0;
  /// Everything asked for earlier is finished before the clock starts, and this frame before it
  /// stops.
  virtual FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel,
                         const Pose& novel_from_world, const RenderOptions& options) = 0;
  /// The frame drawn last, without filling.
  virtual RenderResult ReadBack() = 0;
};

/// cpu::Render or any other function of its kind as a TimedRenderer. Its frames lie in memory when
/// they are drawn.
std::unique_ptr<TimedRenderer> TimeOnCpu(
    std::string description, std::function<RenderResult(const RenderScene&, const PinholeCamera&,
                                                        const Pose&, const RenderOptions&)>
                                 render);

/// Median and interquartile range of repeated measurements, linear between values, and their ends.
struct Times {
  double median_ms = 0, spread_ms = 0;
  double min_ms = 0, max_ms = 0;
};
/// Throws std::invalid_argument for an empty list.
Times TimesOf(std::vector<double> milliseconds);

/// Times of several frames, each kind apart.
class FrameTimes {
 public:
  void Add(const FrameTime& time);
  /// The GPU's clock where all frames have it, else the wall's.
  Times Frame() const;
  Times Cpu() const { return TimesOf(cpu_ms_); }

 private:
  std::vector<double> wall_ms_, cpu_ms_, gpu_ms_;
};

/// Time since it was made.
class StopWatch {
 public:
  StopWatch();
  FrameTime Elapsed() const;

 private:
  std::chrono::steady_clock::time_point start_;
  double cpu_start_ms_;
};

}  // namespace dtr::eval
