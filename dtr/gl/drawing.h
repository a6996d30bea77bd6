// dtr/gl/drawing.h -- what the renderer draws with and into. Only dtr/gl's own .cpp files include
// this.
#pragma once
#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <string>

#include "dtr/base/error.h"
#include "dtr/gl/objects.h"
#include "dtr/types/camera.h"

namespace dtr::gl {

/// The program in use, with its uniforms by name; names that the compiler left out do nothing.
class Uniforms {
 public:
  explicit Uniforms(const Program& program) : program_(program.name()) { glUseProgram(program_); }
  void Set(const char* name, int value) const { glUniform1i(At(name), value); }
  void Set(const char* name, double value) const {
    glUniform1f(At(name), static_cast<float>(value));
  }
  void Set(const char* name, double a, double b) const {
    glUniform2f(At(name), static_cast<float>(a), static_cast<float>(b));
  }
  void Set(const char* name, const Eigen::Vector3d& v) const {
    const Eigen::Vector3f f = v.cast<float>();
    glUniform3fv(At(name), 1, f.data());
  }
  void Set(const char* name, const Eigen::Vector4d& v) const {
    const Eigen::Vector4f f = v.cast<float>();
    glUniform4fv(At(name), 1, f.data());
  }
  void Set(const char* name, const Eigen::Matrix3d& m) const {
    const Eigen::Matrix3f f = m.cast<float>();  // column-major, as in GLSL
    glUniformMatrix3fv(At(name), 1, GL_FALSE, f.data());
  }

 private:
  GLint At(const char* name) const { return glGetUniformLocation(program_, name); }
  GLuint program_;
};

inline Eigen::Vector4d Intrinsics(const PinholeCamera& camera) {
  return {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()};
}

/// DrawnFrame::number of the next one.
inline std::uint64_t NextFrameNumber() {
  static std::atomic<std::uint64_t> last = 0;  // contexts draw in threads of their own
  return ++last;
}

/// A texture to draw into, of one band's size.
inline Texture MakeTarget(GLenum target, GLenum format, int width, int height, int layers) {
  Texture texture = Texture::Make();
  glBindTexture(target, texture.name());
  if (target == GL_TEXTURE_2D_ARRAY) {
    glTexStorage3D(target, 1, format, width, height, layers);
  } else {
    glTexStorage2D(target, 1, format, width, height);
  }
  ThrowOnError("an image of " + std::to_string(width) + "x" + std::to_string(height) +
               " pixels from " + std::to_string(layers) + " views");
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

/// Everything drawn into, for bands of one size; kept from frame to frame.
struct Targets {
  int width = 0, rows = 0, layer_count = 0;
  Texture layers;  ///< depth of each view's nearest fragments: near_z / z, 0 where none is
  Texture image, depth, marks;
  Framebuffer layer_framebuffer, result_framebuffer;

  void Fit(int new_width, int new_rows, int new_layers) {
    if (width == new_width && rows == new_rows && layer_count >= new_layers) return;
    *this = Targets{};
    layers =
        MakeTarget(GL_TEXTURE_2D_ARRAY, GL_DEPTH_COMPONENT32F, new_width, new_rows, new_layers);
    image = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA8, new_width, new_rows, 1);
    depth = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_R32F, new_width, new_rows, 1);
    marks = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA8UI, new_width, new_rows, 1);
    layer_framebuffer = Framebuffer::Make();
    result_framebuffer = Framebuffer::Make();
    glBindFramebuffer(GL_FRAMEBUFFER, result_framebuffer.name());
    const GLuint names[3] = {image.name(), depth.name(), marks.name()};
    GLenum attachments[3];
    for (GLenum i = 0; i < 3; ++i) {
      attachments[i] = GL_COLOR_ATTACHMENT0 + i;
      glFramebufferTextureLayer(GL_FRAMEBUFFER, attachments[i], names[i], 0, 0);
    }
    glDrawBuffers(3, attachments);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw Error(
          "OpenGL: this driver cannot draw into RGBA8, R32F and RGBA8UI at once; "
          "use `renderer` cpu or simd");
    }
    ThrowOnError("an image of " + std::to_string(new_width) + "x" + std::to_string(new_rows) +
                 " pixels");
    width = new_width, rows = new_rows, layer_count = new_layers;  // now it holds
  }

  /// An image that no view shows anything of.
  void ClearResults() const {
    glBindFramebuffer(GL_FRAMEBUFFER, result_framebuffer.name());
    const GLfloat nothing[4] = {0, 0, 0, 0};
    const GLuint no_marks[4] = {0, 0, 0, 0};
    glClearBufferfv(GL_COLOR, 0, nothing);
    glClearBufferfv(GL_COLOR, 1, nothing);
    glClearBufferuiv(GL_COLOR, 2, no_marks);
  }
};

}  // namespace dtr::gl
