// The OpenGL renderer with a context of its own.
#include <memory>
#include <optional>
#include <utility>

#include "cli/render_engine.h"
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

class GlEngine final : public RenderEngine {
 public:
  GlEngine(std::unique_ptr<gl::EglContext> context, const RendererChoice& choice, Progress& console)
      : context_(std::move(context)), renderer_(SettingsOf(choice, console)) {}
  std::string Description() const override { return context_->Description(); }
  bool HasGpuClock() const override { return timer_.has_gpu_clock(); }
  eval::FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) override {
    gl::WaitForGpu();
    const eval::StopWatch watch;
    const std::optional<double> gpu_ms =
        timer_.GpuMilliseconds([&] { renderer_.Draw(scene, novel, novel_from_world, options); });
    eval::FrameTime time = watch.Elapsed();
    time.gpu_ms = gpu_ms;
    objections_.Throw();
    return time;
  }
  RenderResult ReadBack() override { return renderer_.ReadBack(); }
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) override {
    RenderResult result = renderer_.Render(scene, novel, novel_from_world, options);
    objections_.Throw();
    return result;
  }

 private:
  // Members die in reverse order: the context last.
  const std::unique_ptr<gl::EglContext> context_;
  DriverObjections objections_;
  gl::Renderer renderer_;
  gl::FrameTimer timer_;
};

}  // namespace

std::unique_ptr<RenderEngine> MakeGlEngine(const RendererChoice& choice, Progress& console) {
  return std::make_unique<GlEngine>(std::make_unique<gl::EglContext>(), choice, console);
}

std::unique_ptr<RenderEngine> MakeGpuEngine(const RendererChoice& choice, Progress& console,
                                            std::string& why) {
  std::unique_ptr<gl::EglContext> context = gl::EglContext::OnGpu(why);
  if (!context) return nullptr;
  return std::make_unique<GlEngine>(std::move(context), choice, console);
}

}  // namespace dtr::cli
