// dtr/gl/objects.h -- owners of OpenGL names and of the state a renderer may not leave behind.
// Only dtr/gl's own .cpp files and its tests include this.
#pragma once
#include <epoxy/gl.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace dtr::gl {

/// Owns one name of a kind; moved, never copied. The context must be current when it dies.
template <typename Kind>
class Owned {
 public:
  Owned() = default;
  explicit Owned(GLuint name) : name_(name) {}
  ~Owned() {
    if (name_ != 0) Kind::Delete(name_);
  }
  Owned(Owned&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  static Owned Make() { return Owned(Kind::Create()); }
  GLuint name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  GLuint name_ = 0;
};

struct TextureKind {
  static GLuint Create();
  static void Delete(GLuint name) { glDeleteTextures(1, &name); }
};
struct BufferKind {
  static GLuint Create();
  static void Delete(GLuint name) { glDeleteBuffers(1, &name); }
};
struct VertexArrayKind {
  static GLuint Create();
  static void Delete(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct FramebufferKind {
  static GLuint Create();
  static void Delete(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct ProgramKind {
  static GLuint Create() { return glCreateProgram(); }
  static void Delete(GLuint name) { glDeleteProgram(name); }
};
struct ShaderKind {
  static void Delete(GLuint name) { glDeleteShader(name); }
};
using Texture = Owned<TextureKind>;
using Buffer = Owned<BufferKind>;
using VertexArray = Owned<VertexArrayKind>;
using Framebuffer = Owned<FramebufferKind>;
using Program = Owned<ProgramKind>;
using Shader = Owned<ShaderKind>;

/// Throws dtr::Error naming `what` and the error, when GL has recorded one (out of memory above
/// all). Errors from before the last call count too, so callers ForgetErrors first.
void ThrowOnError(const std::string& what);
/// Clears what GL has recorded: the errors of whoever drew before are not ours.
void ForgetErrors();

/// Puts the context's state, as far as this library changes it, back at the end of the scope.
class StateGuard {
 public:
  static constexpr int kTextureUnits = 16;  ///< units 0...15 are restored

  StateGuard();
  ~StateGuard();
  StateGuard(const StateGuard&) = delete;
  StateGuard& operator=(const StateGuard&) = delete;

 private:
  struct Unit {
    GLint texture_array = 0, sampler = 0;
  };
  struct Capability {
    GLenum name;
    GLboolean on;
  };
  /// A buffer at an indexed binding point: whole, or the part that is seen there.
  struct IndexedBuffer {
    GLint buffer = 0;
    GLint64 start = 0, size = 0;  ///< size 0: the whole buffer
    static IndexedBuffer Of(GLenum target, GLuint index);
    void Bind(GLenum target, GLuint index) const;
  };
  /// A texture that shaders write into.
  struct ImageUnit {
    GLint texture = 0, level = 0, layered = 0, layer = 0, access = 0, format = 0;
  };
  std::array<Unit, kTextureUnits> units_;
  std::array<ImageUnit, 3> image_units_;
  std::vector<Capability> capabilities_;
  GLint program_ = 0, vertex_array_ = 0, draw_framebuffer_ = 0, read_framebuffer_ = 0;
  GLint viewport_[4] = {}, active_unit_ = 0;
  GLint array_buffer_ = 0, storage_buffer_ = 0;
  std::array<IndexedBuffer, 6> storage_buffers_{};
  GLint uniform_buffer_ = 0;
  IndexedBuffer uniform_buffer_0_;
  GLint pack_buffer_ = 0, unpack_buffer_ = 0;
  GLint pack_[4] = {}, unpack_[4] = {};
  GLint cull_face_ = 0, front_face_ = 0, polygon_mode_[2] = {};
  std::array<GLboolean, 8> blend_{};                       ///< by draw buffer
  std::array<std::array<GLboolean, 4>, 8> color_masks_{};  ///< by draw buffer
  GLboolean depth_mask_ = GL_TRUE;
  GLint depth_func_ = 0, clip_origin_ = 0, clip_depth_mode_ = 0;
  GLdouble depth_range_[2] = {};
};

}  // namespace dtr::gl
