#include "dtr/gl/compositor.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dtr/gl/drawing.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/objects.h"
#include "dtr/gl/program.h"

namespace dtr::gl {
namespace {

/// What compositing changes, put back at the end of the scope. StateGuard would not do: it takes
/// away what shall hold for the image (depth test, blending, masks).
class CompositeGuard {
 public:
  CompositeGuard() {
    glGetIntegerv(GL_CURRENT_PROGRAM, &program_);
    glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &vertex_array_);
    glGetIntegerv(GL_ACTIVE_TEXTURE, &active_unit_);
    glGetIntegerv(GL_POLYGON_MODE, polygon_mode_.data());
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    for (const GLenum name : {GL_CULL_FACE, GL_FRAMEBUFFER_SRGB, GL_POLYGON_OFFSET_FILL}) {
      TurnOff(name);
    }
    GLint distances = 0, profile = 0;
    glGetIntegerv(GL_MAX_CLIP_DISTANCES, &distances);
    for (GLint i = 0; i < distances; ++i) TurnOff(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i));
    glGetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
    if ((profile & GL_CONTEXT_COMPATIBILITY_PROFILE_BIT) != 0) {
      for (const GLenum name : {GL_ALPHA_TEST, GL_POLYGON_STIPPLE}) TurnOff(name);
    }
    for (size_t i = 0; i < units_.size(); ++i) {
      glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
      glGetIntegerv(GL_TEXTURE_BINDING_2D_ARRAY, &units_[i].texture_array);
      glGetIntegerv(GL_TEXTURE_BINDING_2D, &units_[i].texture);
      glGetIntegerv(GL_SAMPLER_BINDING, &units_[i].sampler);
      glBindSampler(static_cast<GLuint>(i), 0);
    }
  }
  ~CompositeGuard() {
    for (size_t i = 0; i < units_.size(); ++i) {
      glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
      glBindTexture(GL_TEXTURE_2D_ARRAY, static_cast<GLuint>(units_[i].texture_array));
      glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(units_[i].texture));
      glBindSampler(static_cast<GLuint>(i), static_cast<GLuint>(units_[i].sampler));
    }
    glActiveTexture(static_cast<GLenum>(active_unit_));
    for (const GLenum name : turned_off_) glEnable(name);
    glPolygonMode(GL_FRONT_AND_BACK, static_cast<GLenum>(polygon_mode_[0]));
    glBindVertexArray(static_cast<GLuint>(vertex_array_));
    glUseProgram(static_cast<GLuint>(program_));
  }
  CompositeGuard(const CompositeGuard&) = delete;
  CompositeGuard& operator=(const CompositeGuard&) = delete;

 private:
  struct Unit {
    GLint texture_array = 0, texture = 0, sampler = 0;
  };
  void TurnOff(GLenum name) {
    if (glIsEnabled(name) == GL_FALSE) return;
    glDisable(name);
    turned_off_.push_back(name);
  }

  GLint program_ = 0, vertex_array_ = 0, active_unit_ = 0;
  std::array<GLint, 2> polygon_mode_{};
  std::vector<GLenum> turned_off_;
  std::array<Unit, 2> units_;
};

bool TopRowFirst() {
  GLint origin = GL_LOWER_LEFT;
  if (HasClipControl()) glGetIntegerv(GL_CLIP_ORIGIN, &origin);
  return origin == GL_UPPER_LEFT;
}

/// Per axis the factor (x, y) and what is added (z, w); 0 is the image's top row.
Eigen::Vector4d ImageFromPixel(const Viewport& viewport) {
  const double x = 1.0 / viewport.width, y = 1.0 / viewport.height;
  if (TopRowFirst()) return {x, y, -x * viewport.x, -y * viewport.y};
  return {x, -y, -x * viewport.x, y * (viewport.y + viewport.height)};
}

void Bind(GLenum unit, GLenum target, GLuint texture) {
  glActiveTexture(GL_TEXTURE0 + unit);
  glBindTexture(target, texture);
}

}  // namespace

Viewport CurrentViewport() {
  GLint box[4] = {};
  glGetIntegerv(GL_VIEWPORT, box);
  return {box[0], box[1], box[2], box[3]};
}

simd::WindowDepthMapping CurrentMapping(const DepthProjection& projection) {
  simd::WindowDepthMapping mapping;
  mapping.at_infinity = static_cast<float>(projection.at_infinity);
  mapping.per_inverse_depth = static_cast<float>(projection.per_inverse_depth);
  GLint mode = GL_NEGATIVE_ONE_TO_ONE;
  if (HasClipControl()) glGetIntegerv(GL_CLIP_DEPTH_MODE, &mode);
  if (mode == GL_ZERO_TO_ONE) mapping.least = 0, mapping.scale = 1;
  GLfloat range[2] = {};
  glGetFloatv(GL_DEPTH_RANGE, range);
  mapping.near = range[0], mapping.difference = range[1] - range[0];
  mapping.clamps = glIsEnabled(GL_DEPTH_CLAMP) == GL_TRUE;
  return mapping;
}

class Compositor::Implementation {
 public:
  explicit Implementation(std::string shader_folder)
      : programs_(std::move(shader_folder)), empty_array_(VertexArray::Make()) {}

  void Composite(const DrawnFrame& picture, const DepthProjection& projection) {
    const Viewport viewport = CurrentViewport();
    const simd::WindowDepthMapping mapping = CurrentMapping(projection);
    const bool in_memory = picture.rgba != nullptr;
    const CompositeGuard guard;
    if (in_memory) Bring(picture, mapping);
    const Uniforms set(programs_.Get(
        {{GL_VERTEX_SHADER, "full_screen.vert"}, {GL_FRAGMENT_SHADER, "composite.frag"}},
        {in_memory ? "MAPPED 1" : "MAPPED 0"}));
    set.Set("image", 0);
    set.Set("depth", 1);
    set.Set("image_from_pixel", ImageFromPixel(viewport));
    set.Set("mapping", Eigen::Vector4d(mapping.at_infinity, mapping.per_inverse_depth,
                                       mapping.least, mapping.scale));
    set.Set("clamps", mapping.clamps ? 1 : 0);
    const GLenum target = in_memory ? GL_TEXTURE_2D : GL_TEXTURE_2D_ARRAY;
    Bind(0, target, in_memory ? image_.name() : picture.image);
    Bind(1, target, in_memory ? depth_.name() : picture.depth);
    glBindVertexArray(empty_array_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  /// Where `depth` has one and no view saw the pixel it is filled.
  DrawnFrame Take(const RenderResult& result, const Grid<float>& depth) {
    const size_t pixels = result.coverage.data().size();
    taken_rgba_.resize(pixels);
    taken_filled_.resize(pixels);
    for (size_t p = 0; p < pixels; ++p) {
      const std::uint8_t* rgb = &result.image.data()[3 * p];
      taken_rgba_[p] = rgb[0] | rgb[1] << 8 | rgb[2] << 16 | 0xff000000u;
      taken_filled_[p] = result.coverage.data()[p] == 0;
    }
    taken_depth_ = depth.data();
    DrawnFrame picture;
    picture.width_px = result.image.width(), picture.height_px = result.image.height();
    picture.views_used = result.views_used;
    picture.rgba = taken_rgba_.data(), picture.depth_z = taken_depth_.data();
    picture.number = taken_number_ = NextFrameNumber();
    return picture;
  }

 private:
  /// An image in memory to the GPU, its depth as the host's buffer has it: a software rasteriser
  /// takes several times as long for that sum as the processor's vector instructions, and longer
  /// for texels of an array than of a plain texture. Within a CompositeGuard.
  void Bring(const DrawnFrame& picture, const simd::WindowDepthMapping& mapping) {
    const bool known = picture.number != 0 && picture.number == brought_number_;
    if (known && mapping == brought_mapping_) return;
    brought_number_ = 0;  // until all of it is there
    const StateGuard guard;
    const int width = picture.width_px, height = picture.height_px;
    if (width != width_ || height != height_) {
      width_ = height_ = 0;
      // Unit 0 is put back by the CompositeGuard; a host's errors are not to be taken for ours.
      glActiveTexture(GL_TEXTURE0);
      ForgetErrors();
      image_ = MakeTarget(GL_TEXTURE_2D, GL_RGBA8, width, height, 1);
      depth_ = MakeTarget(GL_TEXTURE_2D, GL_R32F, width, height, 1);
      width_ = width, height_ = height;  // now they hold
    }
    const auto send = [&](const Texture& texture, GLenum format, GLenum type, const void* data) {
      Bind(0, GL_TEXTURE_2D, texture.name());
      glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, format, type, data);
    };
    const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    if (!known) send(image_, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba);
    if (picture.window_z != nullptr && picture.mapping == mapping) {
      send(depth_, GL_RED, GL_FLOAT, picture.window_z);
    } else {
      window_z_.resize(pixels);
      const bool has_filled = picture.number == taken_number_;
      simd::MapToWindow(mapping, {picture.depth_z, pixels},
                        has_filled ? std::span<const std::uint8_t>(taken_filled_)
                                   : std::span<const std::uint8_t>(),
                        window_z_);
      send(depth_, GL_RED, GL_FLOAT, window_z_.data());
    }
    brought_number_ = picture.number, brought_mapping_ = mapping;
  }

  ProgramCache programs_;
  VertexArray empty_array_;
  std::vector<std::uint32_t> taken_rgba_;
  std::vector<std::uint8_t> taken_filled_;
  std::vector<float> taken_depth_, window_z_;
  std::uint64_t taken_number_ = 0;
  Texture image_, depth_;  ///< of what was brought last
  int width_ = 0, height_ = 0;
  std::uint64_t brought_number_ = 0;
  simd::WindowDepthMapping brought_mapping_;
};

Compositor::Compositor(std::string shader_folder)
    : implementation_(std::make_unique<Implementation>(std::move(shader_folder))) {}
Compositor::~Compositor() = default;

void Compositor::Composite(const DrawnFrame& picture, const DepthProjection& projection) {
  implementation_->Composite(picture, projection);
}

DrawnFrame Compositor::Take(const RenderResult& result) {
  return implementation_->Take(result, result.depth.grid());
}

DrawnFrame Compositor::TakeFilled(const RenderResult& result, const Grid<float>& depth) {
  return implementation_->Take(result, depth);
}

}  // namespace dtr::gl
