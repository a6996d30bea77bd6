// --renderer auto: gl where a GPU draws, else simd for all that it draws.
#include <fmt/format.h>
#include <stdexcept>

#include "cli/render_engine.h"
#include "dtr/base/error.h"
#include "dtr/simd/renderer.h"

namespace dtr::cli {
namespace {

class AutoEngine final : public RenderEngine {
 public:
  AutoEngine(const RendererChoice& choice, Progress& console) : choice_(choice), console_(console) {
#ifdef DTR_WITH_GL
    gpu_ = MakeGpuEngine(choice, console, why_no_gpu_);
#else
    why_no_gpu_ = "this program was built without OpenGL";
#endif
    if (!gpu_) simd_ = MakeNamedEngine("simd", choice, console);
  }

  std::string Description() const override {
    if (gpu_) return gpu_->Description();
    if (!two_pass_) return simd_->Description();
    return simd_->Description() + "; two passes: " + two_pass_->Description();
  }
  bool HasGpuClock() const override { return gpu_ && gpu_->HasGpuClock(); }
  eval::FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) override {
    drawn_by_ = &EngineFor(options);
    return drawn_by_->Draw(scene, novel, novel_from_world, options);
  }
  RenderResult ReadBack() override {
    if (drawn_by_ == nullptr) throw std::logic_error("ReadBack: nothing was drawn");
    return drawn_by_->ReadBack();
  }
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) override {
    return EngineFor(options).Render(scene, novel, novel_from_world, options);
  }

 private:
  RenderEngine& EngineFor(const RenderOptions& options) {
    if (gpu_) {
      Note(fmt::format("renderer: gl ({})", gpu_->Description()));
      return *gpu_;
    }
    if (simd::Renderer::Draws(options)) {
      Note(fmt::format("renderer: {}; {}", simd_->Description(), why_no_gpu_));
      return *simd_;
    }
    if (!two_pass_) two_pass_ = MakeTwoPassEngine();
    return *two_pass_;
  }

  /// OpenGL by a driver that draws on the processor is several times as fast as the reference.
  std::unique_ptr<RenderEngine> MakeTwoPassEngine() {
    std::string why = why_no_gpu_;
#ifdef DTR_WITH_GL
    try {
      auto engine = MakeNamedEngine("gl", choice_, console_);
      Note(fmt::format("renderer: gl ({}) for the two-pass method, which simd does not draw",
                       engine->Description()));
      return engine;
    } catch (const Error&) {
      why = "this machine has no OpenGL 4.3";
    }
#endif
    Note(fmt::format("renderer: cpu for the two-pass method, which simd does not draw; {}", why));
    return MakeNamedEngine("cpu", choice_, console_);
  }

  void Note(const std::string& line) { choice_.notes->Note(line, console_); }

  const RendererChoice choice_;
  Progress& console_;
  std::string why_no_gpu_;
  std::unique_ptr<RenderEngine> gpu_, simd_, two_pass_;
  RenderEngine* drawn_by_ = nullptr;
};

}  // namespace

std::unique_ptr<RenderEngine> MakeAutoEngine(const RendererChoice& choice, Progress& console) {
  return std::make_unique<AutoEngine>(choice, console);
}

}  // namespace dtr::cli
