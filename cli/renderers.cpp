#include "cli/renderers.h"

#include "dtr/cpu/renderer.h"

namespace dtr::cli {

namespace {

std::vector<std::string> Names() {
#ifdef DTR_WITH_GL
  return {"gl", "cpu"};
#else
  return {"cpu"};
#endif
}

}  // namespace

std::string DefaultRenderer() { return Names().front(); }

void AddRendererOption(CLI::App& command, std::string& name) {
  name = DefaultRenderer();
  std::string type;
  for (const std::string& known : Names()) type += (type.empty() ? "" : "|") + known;
  command
      .add_option("--renderer", name,
                  "OpenGL, or the slow double-precision reference [" + name + "]")
      ->check(CLI::IsMember(Names()))
      ->type_name(type);
}

eval::RenderFunction MakeRenderer(const std::string& name) {
#ifdef DTR_WITH_GL
  if (name == "gl") return MakeGlRenderer();
#endif
  return &cpu::Render;
}

}  // namespace dtr::cli
