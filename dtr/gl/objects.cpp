#include "dtr/gl/objects.h"

#include "dtr/base/error.h"
#include "dtr/gl/driver.h"

namespace dtr::gl {
namespace {

constexpr GLenum kPackNames[4] = {GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS,
                                  GL_PACK_SKIP_PIXELS};
constexpr GLenum kUnpackNames[4] = {GL_UNPACK_ALIGNMENT, GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS,
                                    GL_UNPACK_SKIP_PIXELS};
constexpr GLuint kDrawBuffers = 8;  // any driver has them

/// What may be on and would change what is drawn.
std::vector<GLenum> Capabilities() {
  std::vector<GLenum> names{GL_DEPTH_TEST,
                            GL_SCISSOR_TEST,
                            GL_STENCIL_TEST,
                            GL_CULL_FACE,
                            GL_COLOR_LOGIC_OP,
                            GL_RASTERIZER_DISCARD,
                            GL_PRIMITIVE_RESTART,
                            GL_PRIMITIVE_RESTART_FIXED_INDEX,
                            GL_FRAMEBUFFER_SRGB,
                            GL_DEPTH_CLAMP,
                            GL_POLYGON_OFFSET_FILL,
                            GL_POLYGON_SMOOTH,
                            GL_DITHER,
                            GL_SAMPLE_MASK,
                            GL_SAMPLE_COVERAGE,
                            GL_SAMPLE_ALPHA_TO_COVERAGE,
                            GL_SAMPLE_ALPHA_TO_ONE};
  GLint distances = 0, profile = 0;
  glGetIntegerv(GL_MAX_CLIP_DISTANCES, &distances);
  for (GLint i = 0; i < distances; ++i) {
    names.push_back(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i));
  }
  glGetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
  if ((profile & GL_CONTEXT_COMPATIBILITY_PROFILE_BIT) != 0) {
    names.insert(names.end(), {GL_ALPHA_TEST, GL_POLYGON_STIPPLE});
  }
  return names;
}

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
  throw Error(
      "OpenGL: " + what + ": " + ErrorName(error) + " (code " + std::to_string(error) +
      "); use `renderer` cpu or simd, or a smaller `gpu_memory` or `size`, or fewer `views`");
}

void ForgetErrors() {
  while (glGetError() != GL_NO_ERROR) {
  }
}

StateGuard::IndexedBuffer StateGuard::IndexedBuffer::Of(GLenum target, GLuint index) {
  const bool uniform = target == GL_UNIFORM_BUFFER;
  IndexedBuffer bound;
  glGetIntegeri_v(uniform ? GL_UNIFORM_BUFFER_BINDING : GL_SHADER_STORAGE_BUFFER_BINDING, index,
                  &bound.buffer);
  glGetInteger64i_v(uniform ? GL_UNIFORM_BUFFER_START : GL_SHADER_STORAGE_BUFFER_START, index,
                    &bound.start);
  glGetInteger64i_v(uniform ? GL_UNIFORM_BUFFER_SIZE : GL_SHADER_STORAGE_BUFFER_SIZE, index,
                    &bound.size);
  return bound;
}

void StateGuard::IndexedBuffer::Bind(GLenum target, GLuint index) const {
  const auto name = static_cast<GLuint>(buffer);
  if (buffer != 0 && size > 0) {
    glBindBufferRange(target, index, name, static_cast<GLintptr>(start),
                      static_cast<GLsizeiptr>(size));
  } else {
    glBindBufferBase(target, index, name);
  }
}

StateGuard::StateGuard() {
  for (const GLenum name : Capabilities()) capabilities_.push_back({name, glIsEnabled(name)});
  for (GLuint i = 0; i < kDrawBuffers; ++i) {
    blend_[i] = glIsEnabledi(GL_BLEND, i);
    glGetBooleani_v(GL_COLOR_WRITEMASK, i, color_masks_[i].data());
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
  uniform_buffer_0_ = IndexedBuffer::Of(GL_UNIFORM_BUFFER, 0);
  for (GLuint i = 0; i < storage_buffers_.size(); ++i) {
    storage_buffers_[i] = IndexedBuffer::Of(GL_SHADER_STORAGE_BUFFER, i);
  }
  glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &pack_buffer_);
  glGetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &unpack_buffer_);
  for (int i = 0; i < 4; ++i) {
    glGetIntegerv(kPackNames[i], &pack_[i]);
    glGetIntegerv(kUnpackNames[i], &unpack_[i]);
  }
  glGetIntegerv(GL_CULL_FACE_MODE, &cull_face_);
  glGetIntegerv(GL_FRONT_FACE, &front_face_);
  glGetIntegerv(GL_POLYGON_MODE, polygon_mode_);
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
  for (GLuint i = 0; i < image_units_.size(); ++i) {
    ImageUnit& unit = image_units_[i];
    glGetIntegeri_v(GL_IMAGE_BINDING_NAME, i, &unit.texture);
    glGetIntegeri_v(GL_IMAGE_BINDING_LEVEL, i, &unit.level);
    glGetIntegeri_v(GL_IMAGE_BINDING_LAYERED, i, &unit.layered);
    glGetIntegeri_v(GL_IMAGE_BINDING_LAYER, i, &unit.layer);
    glGetIntegeri_v(GL_IMAGE_BINDING_ACCESS, i, &unit.access);
    glGetIntegeri_v(GL_IMAGE_BINDING_FORMAT, i, &unit.format);
  }
  // What both passes take for granted.
  for (const Capability& capability : capabilities_) glDisable(capability.name);
  glDisable(GL_BLEND);
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
  for (GLuint i = 0; i < image_units_.size(); ++i) {
    const ImageUnit& unit = image_units_[i];
    glBindImageTexture(i, name(unit.texture), unit.level, unit.layered != 0 ? GL_TRUE : GL_FALSE,
                       unit.layer, name(unit.access), name(unit.format));
  }
  for (const Capability& capability : capabilities_) {
    SetEnabled(capability.name, capability.on == GL_TRUE);
  }
  for (GLuint i = 0; i < kDrawBuffers; ++i) {
    blend_[i] == GL_TRUE ? glEnablei(GL_BLEND, i) : glDisablei(GL_BLEND, i);
    const auto& mask = color_masks_[i];
    glColorMaski(i, mask[0], mask[1], mask[2], mask[3]);
  }
  glUseProgram(name(program_));
  glBindVertexArray(name(vertex_array_));
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, name(draw_framebuffer_));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, name(read_framebuffer_));
  glViewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
  glBindBuffer(GL_ARRAY_BUFFER, name(array_buffer_));
  uniform_buffer_0_.Bind(GL_UNIFORM_BUFFER, 0);
  glBindBuffer(GL_UNIFORM_BUFFER, name(uniform_buffer_));
  for (GLuint i = 0; i < storage_buffers_.size(); ++i) {
    storage_buffers_[i].Bind(GL_SHADER_STORAGE_BUFFER, i);
  }
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, name(storage_buffer_));
  glBindBuffer(GL_PIXEL_PACK_BUFFER, name(pack_buffer_));
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, name(unpack_buffer_));
  for (int i = 0; i < 4; ++i) {
    glPixelStorei(kPackNames[i], pack_[i]);
    glPixelStorei(kUnpackNames[i], unpack_[i]);
  }
  glCullFace(name(cull_face_));
  glFrontFace(name(front_face_));
  glPolygonMode(GL_FRONT_AND_BACK, name(polygon_mode_[0]));
  glDepthMask(depth_mask_);
  glDepthFunc(name(depth_func_));
  glDepthRange(depth_range_[0], depth_range_[1]);
  if (HasClipControl()) glClipControl(name(clip_origin_), name(clip_depth_mode_));
}

}  // namespace dtr::gl
