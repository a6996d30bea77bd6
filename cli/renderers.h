// cli/renderers.h -- the renderers by name, as --renderer knows them.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/timed_renderer.h"

namespace dtr::cli {

/// What --renderer, --shader-dir and --gpu-memory say.
struct RendererChoice {
  std::string name;                     ///< "gl" or "cpu"
  std::filesystem::path shader_folder;  ///< empty: the shaders inside the program
  double gpu_memory_gb = 4;             ///< for the views on the GPU, "gl" only
};

/// Adds --renderer and, in programs built with OpenGL, --shader-dir and --gpu-memory to a command.
void AddRendererOptions(CLI::App& command, RendererChoice& choice);

/// Adds --shader-dir and --gpu-memory, for what draws with OpenGL alone.
void AddOpenGlOptions(CLI::App& command, RendererChoice& choice);

/// The names that --renderer knows, the default first.
std::vector<std::string> RendererNames();

/// The default: "gl" in programs built with OpenGL, else "cpu".
std::string DefaultRenderer();

/// The renderer of that choice, ready to draw: a context is opened here for "gl", on the thread
/// that must draw with it too. Throws dtr::Error, one line that names --renderer cpu, where the
/// machine has no OpenGL 4.3: nothing falls back silently. Throws UsageError for a shader folder
/// that is not there or goes with another renderer. `console` must outlive the renderer: it is told
/// when memory holds fewer views than an image asks for.
eval::RenderFunction MakeRenderer(const RendererChoice& choice, Progress& console);
/// The same, for its frames to be timed.
std::unique_ptr<eval::TimedRenderer> MakeTimedRenderer(const RendererChoice& choice,
                                                       Progress& console);

/// "gl"; only in programs built with OpenGL.
eval::RenderFunction MakeGlRenderer(const RendererChoice& choice, Progress& console);
std::unique_ptr<eval::TimedRenderer> MakeTimedGlRenderer(const RendererChoice& choice,
                                                         Progress& console);

}  // namespace dtr::cli
