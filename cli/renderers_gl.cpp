// The OpenGL renderer with a context of its own.
#include <memory>
#include <optional>

#include "cli/renderers.h"
#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/gl/context.h"
#include "dtr/gl/frame_timer.h"
#include "dtr/gl/renderer.h"

namespace dtr::cli {
namespace {

gl::RendererSettings SettingsOf(const RendererChoice& choice, Progress& console) {
  gl::RendererSettings settings;
  settings.shader_folder = choice.shader_folder.string();
  settings.gpu_bytes = static_cast<size_t>(choice.gpu_memory_gb * kBytesPerGigabyte);
  settings.warn = [&console](const std::string& line) { console.Note(line); };
  return settings;
}

/// In development builds what the driver objects to ends the program; in others nobody listens.
class DriverObjections {
 public:
#ifdef NDEBUG
  void Throw() const {}
#else
  void Throw() const {
    if (output_.errors() > 0) {
      throw Error("OpenGL: the driver reports an error, see above; use --renderer cpu");
    }
  }

 private:
  gl::DebugOutput output_;
#endif
};

/// Members die in reverse order: the context last.
struct Drawing {
  Drawing(const RendererChoice& choice, Progress& console)
      : renderer(SettingsOf(choice, console)) {}
  gl::EglContext context;
  DriverObjections objections;
  gl::Renderer renderer;
};

class TimedGlRenderer final : public eval::TimedRenderer {
 public:
  TimedGlRenderer(const RendererChoice& choice, Progress& console) : drawing_(choice, console) {}
  std::string Description() const override { return drawing_.context.Description(); }
  bool HasGpuClock() const override { return timer_.has_gpu_clock(); }
  eval::FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) override {
    gl::WaitForGpu();
    const eval::StopWatch watch;
    const std::optional<double> gpu_ms = timer_.GpuMilliseconds(
        [&] { drawing_.renderer.Draw(scene, novel, novel_from_world, options); });
    eval::FrameTime time = watch.Elapsed();
    time.gpu_ms = gpu_ms;
    drawing_.objections.Throw();
    return time;
  }
  RenderResult ReadBack() override { return drawing_.renderer.ReadBack(); }

 private:
  Drawing drawing_;
  gl::FrameTimer timer_;
};

}  // namespace

eval::RenderFunction MakeGlRenderer(const RendererChoice& choice, Progress& console) {
  auto drawing = std::make_shared<Drawing>(choice, console);
  return [drawing](const RenderScene& scene, const PinholeCamera& novel,
                   const Pose& novel_from_world, const RenderOptions& options) {
    RenderResult result = drawing->renderer.Render(scene, novel, novel_from_world, options);
    drawing->objections.Throw();
    return result;
  };
}

std::unique_ptr<eval::TimedRenderer> MakeTimedGlRenderer(const RendererChoice& choice,
                                                         Progress& console) {
  return std::make_unique<TimedGlRenderer>(choice, console);
}

}  // namespace dtr::cli
