#include "cli/renderers.h"

#include <fmt/format.h>

#include "cli/number_checks.h"
#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"

namespace dtr::cli {

namespace {

void CheckShaderFolder(const RendererChoice& choice) {
  const std::filesystem::path& folder = choice.shader_folder;
  if (folder.empty()) return;
  if (choice.name != "gl") {
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

}  // namespace

std::vector<std::string> RendererNames() {
#ifdef DTR_WITH_GL
  return {"gl", "cpu"};
#else
  return {"cpu"};
#endif
}

std::string DefaultRenderer() { return RendererNames().front(); }

void AddRendererOptions(CLI::App& command, RendererChoice& choice) {
  choice.name = DefaultRenderer();
  std::string type;
  for (const std::string& known : RendererNames()) type += (type.empty() ? "" : "|") + known;
  command
      .add_option("--renderer", choice.name,
                  "OpenGL, or the slow double-precision reference [" + choice.name + "]")
      ->check(CLI::IsMember(RendererNames()))
      ->type_name(type);
#ifdef DTR_WITH_GL
  AddOpenGlOptions(command, choice);
#endif
}

void AddOpenGlOptions(CLI::App& command, RendererChoice& choice) {
  command
      .add_option("--shader-dir", choice.shader_folder,
                  "Shaders of this folder instead of the program's own, for work on them")
      ->type_name("DIR");
  command
      .add_option("--gpu-memory", choice.gpu_memory_gb,
                  "Memory for the views on the GPU; others are dropped and put there again [4]")
      ->check(kPositive)
      ->check(CLI::Range(0.0, kMaxGigabytes))
      ->type_name("GB");
}

eval::RenderFunction MakeRenderer(const RendererChoice& choice,
                                  [[maybe_unused]] Progress& console) {
  CheckShaderFolder(choice);
#ifdef DTR_WITH_GL
  if (choice.name == "gl") return MakeGlRenderer(choice, console);
#endif
  return &cpu::Render;
}

std::unique_ptr<eval::TimedRenderer> MakeTimedRenderer(const RendererChoice& choice,
                                                       [[maybe_unused]] Progress& console) {
  CheckShaderFolder(choice);
#ifdef DTR_WITH_GL
  if (choice.name == "gl") return MakeTimedGlRenderer(choice, console);
#endif
  return eval::TimeOnCpu("dtr/cpu, the reference renderer", &cpu::Render);
}

}  // namespace dtr::cli
