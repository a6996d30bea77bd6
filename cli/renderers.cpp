#include "cli/renderers.h"

#include <fmt/format.h>

#include "cli/number_checks.h"
#include "cli/render_engine.h"
#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/cpu/renderer.h"
#include "dtr/simd/renderer.h"

namespace dtr::cli {
namespace {

#ifdef DTR_WITH_GL
constexpr bool kWithOpenGl = true;
#else
constexpr bool kWithOpenGl = false;
#endif

void CheckShaderFolder(const RendererChoice& choice) {
  const std::filesystem::path& folder = choice.shader_folder;
  if (folder.empty()) return;
  if (choice.name != "gl" && choice.name != "auto") {
    throw UsageError(fmt::format("--shader-dir {}: expected --renderer gl with it, found {}",
                                 folder.string(), choice.name));
  }
  if (!std::filesystem::is_directory(folder)) {
    throw UsageError(
        fmt::format("--shader-dir {}: expected a folder of shaders such as dtr/gl/shaders, found "
                    "none",
                    folder.string()));
  }
}

void AddOptions(CLI::App& command, const std::vector<std::string>& names, RendererChoice& choice) {
  command
      .add_option("--renderer", choice.name,
                  "OpenGL; the processor's vector instructions; or the slow double-precision "
                  "reference. auto: gl on a GPU, else simd [auto]")
      ->check(CLI::IsMember(names))
      ->type_name(fmt::format("{}", fmt::join(names, "|")));
  if (kWithOpenGl) {
    command
        .add_option("--shader-dir", choice.shader_folder,
                    "Shaders of this folder instead of the program's own, for work on them")
        ->type_name("DIR");
  }
  command
      .add_option("--gpu-memory", choice.gpu_memory_gb,
                  "Memory for views that are ready to be drawn, on the GPU or, by simd, in main "
                  "memory; others are dropped and prepared again [4]")
      ->check(kPositive)
      ->check(CLI::Range(0.0, kMaxGigabytes))
      ->type_name("GB");
}

class CpuEngine final : public RenderEngine {
 public:
  std::string Description() const override { return timed_->Description(); }
  bool HasGpuClock() const override { return false; }
  eval::FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) override {
    return timed_->Draw(scene, novel, novel_from_world, options);
  }
  RenderResult ReadBack() override { return timed_->ReadBack(); }
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) override {
    return cpu::Render(scene, novel, novel_from_world, options);
  }

 private:
  const std::unique_ptr<eval::TimedRenderer> timed_ =
      eval::TimeOnCpu("dtr/cpu, the reference renderer", &cpu::Render);
};

class SimdEngine final : public RenderEngine {
 public:
  SimdEngine(const RendererChoice& choice, Progress& console)
      : renderer_({static_cast<size_t>(choice.gpu_memory_gb * kBytesPerGigabyte),
                   [&console](const std::string& line) { console.Note(line); }}) {}
  std::string Description() const override { return simd::Description(); }
  bool HasGpuClock() const override { return false; }
  eval::FrameTime Draw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) override {
    const eval::StopWatch watch;
    renderer_.Draw(scene, novel, novel_from_world, options);
    return watch.Elapsed();
  }
  RenderResult ReadBack() override { return renderer_.ReadBack(); }
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) override {
    return renderer_.Render(scene, novel, novel_from_world, options);
  }

 private:
  simd::Renderer renderer_;
};

std::unique_ptr<RenderEngine> MakeEngine(const RendererChoice& choice, Progress& console) {
  CheckShaderFolder(choice);
  if (choice.name != "auto") return MakeNamedEngine(choice.name, choice, console);
  // Shaders are gl's alone.
  return choice.shader_folder.empty() ? MakeAutoEngine(choice, console)
                                      : MakeNamedEngine("gl", choice, console);
}

}  // namespace

std::unique_ptr<RenderEngine> MakeNamedEngine(const std::string& name, const RendererChoice& choice,
                                              Progress& console) {
#ifdef DTR_WITH_GL
  if (name == "gl") return MakeGlEngine(choice, console);
#endif
  if (name == "simd") return std::make_unique<SimdEngine>(choice, console);
  return std::make_unique<CpuEngine>();
}

std::vector<std::string> RendererNames() {
  if (kWithOpenGl) return {"auto", "gl", "simd", "cpu"};
  return {"auto", "simd", "cpu"};
}

void AddMeasuredOnly(CLI::App& command, bool& measured_only) {
  command.add_flag("--measured-only", measured_only,
                   "Draw measured depth alone, without what was completed");
}

void AddRendererOptions(CLI::App& command, RendererChoice& choice) {
  AddOptions(command, RendererNames(), choice);
}

void AddWindowRendererOptions(CLI::App& command, RendererChoice& choice) {
  AddOptions(command, {"auto", "gl", "simd"}, choice);
}

eval::RenderFunction MakeRenderer(const RendererChoice& choice, Progress& console) {
  const std::shared_ptr<RenderEngine> engine = MakeEngine(choice, console);
  return [engine](const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options) {
    return engine->Render(scene, novel, novel_from_world, options);
  };
}

std::unique_ptr<eval::TimedRenderer> MakeTimedRenderer(const RendererChoice& choice,
                                                       Progress& console) {
  return MakeEngine(choice, console);
}

}  // namespace dtr::cli
