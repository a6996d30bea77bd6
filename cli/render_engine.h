// cli/render_engine.h -- one renderer as commands use it: for results, and with its frames timed.
#pragma once
#include <memory>
#include <string>

#include "cli/renderers.h"
#include "dtr/base/progress.h"
#include "dtr/eval/timed_renderer.h"

namespace dtr::cli {

class RenderEngine : public eval::TimedRenderer {
 public:
  /// As cpu::Render.
  virtual RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                              const Pose& novel_from_world, const RenderOptions& options) = 0;
};

/// "gl"; only in programs built with OpenGL.
std::unique_ptr<RenderEngine> MakeGlEngine(const RendererChoice& choice, Progress& console);
/// The same where a GPU draws, else null and in `why` the reason.
std::unique_ptr<RenderEngine> MakeGpuEngine(const RendererChoice& choice, Progress& console,
                                            std::string& why);

/// "auto".
std::unique_ptr<RenderEngine> MakeAutoEngine(const RendererChoice& choice, Progress& console);

/// Any name but "auto".
std::unique_ptr<RenderEngine> MakeNamedEngine(const std::string& name, const RendererChoice& choice,
                                              Progress& console);

}  // namespace dtr::cli
