// The OpenGL renderer with a context of its own.
#include <memory>

#include "cli/renderers.h"
#include "dtr/gl/context.h"
#include "dtr/gl/renderer.h"

namespace dtr::cli {

eval::RenderFunction MakeGlRenderer() {
  struct Drawing {
    gl::EglContext context;
    gl::Renderer renderer;  // dies before its context
  };
  auto drawing = std::make_shared<Drawing>();
  return [drawing](const RenderScene& scene, const PinholeCamera& novel,
                   const Pose& novel_from_world, const RenderOptions& options) {
    return drawing->renderer.Render(scene, novel, novel_from_world, options);
  };
}

}  // namespace dtr::cli
