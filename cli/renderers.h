// cli/renderers.h -- the renderers by name, as --renderer knows them.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/timed_renderer.h"

namespace dtr::cli {

/// Lines that a command prints once, however many renderers it makes. Any thread.
class OnceNotes {
 public:
  void Note(const std::string& line, Progress& console) {
    const std::lock_guard lock(mutex_);
    if (noted_.insert(line).second) console.Note(line);
  }

 private:
  std::mutex mutex_;
  std::set<std::string> noted_;
};

/// What --renderer, --shader-dir and --gpu-memory say.
struct RendererChoice {
  std::string name = "auto";            ///< "auto", "gl", "simd" or "cpu"
  std::filesystem::path shader_folder;  ///< empty: the shaders inside the program
  double gpu_memory_gb = 4;             ///< for what "gl" and "simd" make of the views
  std::shared_ptr<OnceNotes> notes = std::make_shared<OnceNotes>();
};

/// Adds --renderer, --gpu-memory and, in programs built with OpenGL, --shader-dir to a command.
void AddRendererOptions(CLI::App& command, RendererChoice& choice);
/// Declares --measured-only.
void AddMeasuredOnly(CLI::App& command, bool& measured_only);

/// The same for a window, which "cpu" is too slow for.
void AddWindowRendererOptions(CLI::App& command, RendererChoice& choice);

/// The names that --renderer knows, the default first.
std::vector<std::string> RendererNames();

/// The renderer of that choice, ready to draw. "gl" opens its context here, on the thread that must
/// draw with it too; throws dtr::Error, one line that names --renderer cpu, where the machine has
/// no OpenGL 4.3. "auto" takes "gl" where a GPU draws, else "simd" for the deferred method and for
/// two passes "gl" or, without OpenGL, "cpu"; a line says which when it first draws. Throws
/// UsageError for a shader folder that is not there or goes with another renderer. `console` must
/// outlive the renderer: it is told when memory holds fewer views than an image asks for.
eval::RenderFunction MakeRenderer(const RendererChoice& choice, Progress& console);
/// The same, for its frames to be timed.
std::unique_ptr<eval::TimedRenderer> MakeTimedRenderer(const RendererChoice& choice,
                                                       Progress& console);

}  // namespace dtr::cli
