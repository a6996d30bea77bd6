#include "dtr/gl/driver.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <iterator>

namespace dtr::gl {

bool IsSoftwareRasteriser(std::string_view renderer) {
  constexpr std::string_view kNames[] = {"llvmpipe", "softpipe", "swr", "SWR", "SwiftShader"};
  return std::any_of(std::begin(kNames), std::end(kNames), [&](std::string_view name) {
    return renderer.find(name) != std::string_view::npos;
  });
}

bool DrawsOnProcessor() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return renderer != nullptr && IsSoftwareRasteriser(renderer);
}

bool HasClipControl() {
  return epoxy_gl_version() >= 45 || epoxy_has_gl_extension("GL_ARB_clip_control");
}

size_t MostStorageBytes() {
  GLint64 bytes = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
  return static_cast<size_t>(bytes);
}

}  // namespace dtr::gl
