#include "dtr/gl/objects.h"

#include "dtr/base/error.h"

namespace dtr::gl {
namespace {

constexpr GLenum kPackNames[4] = {GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS,
                                  GL_PACK_SKIP_PIXELS};
constexpr GLenum kUnpackNames[4] = {GL_UNPACK_ALIGNMENT, GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS,
                                    GL_UNPACK_SKIP_PIXELS};
constexpr std::array<GLenum, 15> kCapabilities{GL_BLEND,
                                               GL_DEPTH_TEST,
                                               GL_SCISSOR_TEST,
                                               GL_STENCIL_TEST,
                                               GL_CULL_FACE,
                                               GL_COLOR_LOGIC_OP,
                                               GL_RASTERIZER_DISCARD,
                                               GL_PRIMITIVE_RESTART,
                                               GL_FRAMEBUFFER_SRGB,
                                               GL_DEPTH_CLAMP,
                                               GL_POLYGON_OFFSET_FILL,
                                               GL_DITHER,
                                               GL_SAMPLE_MASK,
                                               GL_SAMPLE_COVERAGE,
                                               GL_PRIMITIVE_RESTART_FIXED_INDEX};

const char* ErrorName(GLenum error) {
  switch (error) {
    case GL_OUT_OF_MEMORY:
      return "out of GPU memory";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "an incomplete framebuffer";
    default:
      return "an OpenGL error";
  }
}

GLuint OneName(void (*generate)(GLsizei, GLuint*)) {
  GLuint name = 0;
  generate(1, &name);
  return name;
}

void SetEnabled(GLenum name, bool on) { on ? glEnable(name) : glDisable(name); }

}  // namespace

GLuint TextureKind::Create() { return OneName(glGenTextures); }
GLuint BufferKind::Create() { return OneName(glGenBuffers); }
GLuint VertexArrayKind::Create() { return OneName(glGenVertexArrays); }
GLuint FramebufferKind::Create() { return OneName(glGenFramebuffers); }

void ThrowOnError(const std::string& what) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  throw Error("OpenGL: " + what + ": " + ErrorName(error) + " (code " + std::to_string(error) +
              "); use --renderer cpu, or a smaller --gpu-memory or --size, or fewer --views");
}

bool HasClipControl() {
  return epoxy_gl_version() >= 45 || epoxy_has_gl_extension("GL_ARB_clip_control");
}

StateGuard::StateGuard() {
  for (size_t i = 0; i < kCapabilities.size(); ++i) {
    capabilities_[i] = {kCapabilities[i], glIsEnabled(kCapabilities[i])};
  }
  glGetIntegerv(GL_CURRENT_PROGRAM, &program_);
  glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &vertex_array_);
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &draw_framebuffer_);
  glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &read_framebuffer_);
  glGetIntegerv(GL_VIEWPORT, viewport_);
  glGetIntegerv(GL_ACTIVE_TEXTURE, &active_unit_);
  glGetIntegerv(GL_ARRAY_BUFFER_BINDING, &array_buffer_);
  glGetIntegerv(GL_SHADER_STORAGE_BUFFER_BINDING, &storage_buffer_);
  glGetIntegerv(GL_UNIFORM_BUFFER_BINDING, &uniform_buffer_);
  glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, 0, &uniform_buffer_0_);
  for (GLuint i = 0; i < storage_buffers_.size(); ++i) {
    glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, i, &storage_buffers_[i]);
  }
  glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &pack_buffer_);
  glGetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &unpack_buffer_);
  for (int i = 0; i < 4; ++i) {
    glGetIntegerv(kPackNames[i], &pack_[i]);
    glGetIntegerv(kUnpackNames[i], &unpack_[i]);
  }
  glGetIntegerv(GL_BLEND_EQUATION_RGB, &blend_equation_rgb_);
  glGetIntegerv(GL_BLEND_EQUATION_ALPHA, &blend_equation_alpha_);
  glGetIntegerv(GL_CULL_FACE_MODE, &cull_face_);
  glGetIntegerv(GL_FRONT_FACE, &front_face_);
  glGetIntegerv(GL_POLYGON_MODE, polygon_mode_);
  glGetIntegerv(GL_PROVOKING_VERTEX, &provoking_vertex_);
  glGetBooleanv(GL_COLOR_WRITEMASK, color_mask_);
  glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
  glGetIntegerv(GL_DEPTH_FUNC, &depth_func_);
  glGetDoublev(GL_DEPTH_RANGE, depth_range_);
  if (HasClipControl()) {
    glGetIntegerv(GL_CLIP_ORIGIN, &clip_origin_);
    glGetIntegerv(GL_CLIP_DEPTH_MODE, &clip_depth_mode_);
    glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  }
  for (int i = 0; i < kTextureUnits; ++i) {
    Unit& unit = units_[static_cast<size_t>(i)];
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
    glGetIntegerv(GL_TEXTURE_BINDING_2D_ARRAY, &unit.texture_array);
    glGetIntegerv(GL_SAMPLER_BINDING, &unit.sampler);
    glBindSampler(static_cast<GLuint>(i), 0);
  }
  // What both passes take for granted.
  for (const GLenum name : kCapabilities) glDisable(name);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  for (int i = 0; i < 4; ++i) {
    glPixelStorei(kPackNames[i], i == 0 ? 1 : 0);
    glPixelStorei(kUnpackNames[i], i == 0 ? 1 : 0);
  }
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glDepthRange(0, 1);
}

StateGuard::~StateGuard() {
  const auto name = [](GLint value) { return static_cast<GLuint>(value); };
  for (int i = 0; i < kTextureUnits; ++i) {
    const Unit& unit = units_[static_cast<size_t>(i)];
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
    glBindTexture(GL_TEXTURE_2D_ARRAY, name(unit.texture_array));
    glBindSampler(static_cast<GLuint>(i), name(unit.sampler));
  }
  glActiveTexture(name(active_unit_));
  for (const Capability& capability : capabilities_) {
    SetEnabled(capability.name, capability.on == GL_TRUE);
  }
  glUseProgram(name(program_));
  glBindVertexArray(name(vertex_array_));
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, name(draw_framebuffer_));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name(read_framebuffer_));
  glViewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
  glBindBuffer(GL_ARRAY_BUFFER, name(array_buffer_));
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, name(uniform_buffer_0_));
  glBindBuffer(GL_UNIFORM_BUFFER, name(uniform_buffer_));
  for (GLuint i = 0; i < storage_buffers_.size(); ++i) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, name(storage_buffers_[i]));
  }
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, name(storage_buffer_));
  glBindBuffer(GL_PIXEL_PACK_BUFFER, name(pack_buffer_));
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, name(unpack_buffer_));
  for (int i = 0; i < 4; ++i) {
    glPixelStorei(kPackNames[i], pack_[i]);
    glPixelStorei(kUnpackNames[i], unpack_[i]);
  }
  glBlendEquationSeparate(name(blend_equation_rgb_), name(blend_equation_alpha_));
  glCullFace(name(cull_face_));
  glFrontFace(name(front_face_));
  glPolygonMode(GL_FRONT_AND_BACK, name(polygon_mode_[0]));
  glProvokingVertex(name(provoking_vertex_));
  glDepthMask(depth_mask_);
  glDepthFunc(name(depth_func_));
  glDepthRange(depth_range_[0], depth_range_[1]);
  if (HasClipControl()) glClipControl(name(clip_origin_), name(clip_depth_mode_));
  glColorMask(color_mask_[0], color_mask_[1], color_mask_[2], color_mask_[3]);
}

}  // namespace dtr::gl
