#include "dtr/eval/timed_renderer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "dtr/base/machine.h"

namespace dtr::eval {
namespace {

/// Value at share `q` of a sorted list, linear between its entries.
double Quantile(const std::vector<double>& sorted, double q) {
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(std::floor(at));
  const size_t above = std::min(below + 1, sorted.size() - 1);
  const double share = at - static_cast<double>(below);
  return (1 - share) * sorted[below] + share * sorted[above];
}

class OnCpu final : public TimedRenderer {
 public:
  using Function = std::function<RenderResult(const RenderScene&, const PinholeCamera&, const Pose&,
                                              const RenderOptions&)>;
  OnCpu(std::string description, Function render)
      : description_(std::move(description)), render_(std::move(render)) {}
  std::string Description() const override { return description_; }
  bool HasGpuClock() const override { return false; }
  FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
                 const RenderOptions& options) override {
    RenderOptions unfinished = options;
    unfinished.fill_holes = unfinished.smooth_edges = false;
    const StopWatch watch;
    drawn_ = render_(scene, novel, novel_from_world, unfinished);
    return watch.Elapsed();
  }
  RenderResult ReadBack() override { return drawn_; }

 private:
  const std::string description_;
  const Function render_;
  RenderResult drawn_;
};

}  // namespace

std::unique_ptr<TimedRenderer> TimeOnCpu(std::string description, OnCpu::Function render) {
  return std::make_unique<OnCpu>(std::move(description), std::move(render));
}

Times TimesOf(std::vector<double> milliseconds) {
  if (milliseconds.empty()) throw std::invalid_argument("TimesOf: nothing was measured");
  std::sort(milliseconds.begin(), milliseconds.end());
  return {Quantile(milliseconds, 0.5), Quantile(milliseconds, 0.75) - Quantile(milliseconds, 0.25),
          milliseconds.front(), milliseconds.back()};
}

void FrameTimes::Add(const FrameTime& time) {
  wall_ms_.push_back(time.wall_ms);
  cpu_ms_.push_back(time.cpu_ms);
  if (time.gpu_ms) gpu_ms_.push_back(*time.gpu_ms);
}

Times FrameTimes::Frame() const {
  return TimesOf(gpu_ms_.size() == wall_ms_.size() ? gpu_ms_ : wall_ms_);
}

StopWatch::StopWatch()
    : start_(std::chrono::steady_clock::now()), cpu_start_ms_(ProcessCpuMilliseconds()) {}

FrameTime StopWatch::Elapsed() const {
  const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start_;
  return {wall.count(), ProcessCpuMilliseconds() - cpu_start_ms_, std::nullopt};
}

}  // namespace dtr::eval
