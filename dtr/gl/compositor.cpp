#include "dtr/gl/compositor.h"

#include <array>
#include <cstdint>
#include <vector>

#include "dtr/gl/drawing.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/program.h"

namespace dtr::gl {
namespace {

/// Alpha of what was filled, not seen; composite.frag knows it as neither 0 nor 1.
constexpr std::uint8_t kGuessedAlpha = 128;

/// What compositing changes, put back at the end of the scope. StateGuard would not do: it takes
/// away what shall hold for the picture (depth test, blending, masks).
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
      glGetIntegerv(GL_TEXTURE_BINDING_2D_ARRAY, &units_[i].texture);
      glGetIntegerv(GL_SAMPLER_BINDING, &units_[i].sampler);
      glBindSampler(static_cast<GLuint>(i), 0);
    }
  }
  ~CompositeGuard() {
    for (size_t i = 0; i < units_.size(); ++i) {
      glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
      glBindTexture(GL_TEXTURE_2D_ARRAY, static_cast<GLuint>(units_[i].texture));
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
    GLint texture = 0, sampler = 0;
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

/// Device z of the near plane, and window z per device z.
std::array<double, 2> DeviceDepthRange() {
  GLint mode = GL_NEGATIVE_ONE_TO_ONE;
  if (HasClipControl()) glGetIntegerv(GL_CLIP_DEPTH_MODE, &mode);
  if (mode == GL_ZERO_TO_ONE) return {0, 1};
  return {-1, 0.5};
}

bool TopRowFirst() {
  GLint origin = GL_LOWER_LEFT;
  if (HasClipControl()) glGetIntegerv(GL_CLIP_ORIGIN, &origin);
  return origin == GL_UPPER_LEFT;
}

/// Per axis the factor (x, y) and what is added (z, w); row 0 of the picture is its top row.
Eigen::Vector4d TexelFromPixel(const DrawnPicture& picture, const Viewport& viewport) {
  const double x = static_cast<double>(picture.width_px) / viewport.width;
  const double y = static_cast<double>(picture.height_px) / viewport.height;
  if (TopRowFirst()) return {x, y, -x * viewport.x, -y * viewport.y};
  return {x, -y, -x * viewport.x, y * (viewport.y + viewport.height)};
}

void Bind(GLenum unit, GLuint texture) {
  glActiveTexture(GL_TEXTURE0 + unit);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
}

}  // namespace

Viewport CurrentViewport() {
  GLint box[4] = {};
  glGetIntegerv(GL_VIEWPORT, box);
  return {box[0], box[1], box[2], box[3]};
}

class Compositor::Implementation {
 public:
  explicit Implementation(std::string shader_folder)
      : programs_(std::move(shader_folder)), empty_array_(VertexArray::Make()) {}

  void Composite(const DrawnPicture& picture, const DepthProjection& projection) {
    const Viewport viewport = CurrentViewport();
    const auto [least, scale] = DeviceDepthRange();
    const CompositeGuard guard;
    const bool packed = picture.texels != 0;
    const Uniforms set(programs_.Get(
        {{GL_VERTEX_SHADER, "full_screen.vert"}, {GL_FRAGMENT_SHADER, "composite.frag"}},
        {packed ? "PACKED 1" : "PACKED 0"}));
    set.Set(packed ? "texels" : "image", 0);
    set.Set("depth", 1);
    set.Set("texel_from_pixel", TexelFromPixel(picture, viewport));
    set.Set("mapping",
            Eigen::Vector4d(projection.at_infinity, projection.per_inverse_depth, least, scale));
    set.Set("clamps", glIsEnabled(GL_DEPTH_CLAMP) == GL_TRUE ? 1 : 0);
    Bind(0, packed ? picture.texels : picture.image);
    Bind(1, picture.depth);
    glBindVertexArray(empty_array_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  /// Where `depth` has one and no view saw the pixel it is a guess.
  DrawnPicture Upload(const RenderResult& result, const Grid<float>& depth) {
    const StateGuard guard;
    const int width = result.image.width(), height = result.image.height();
    std::vector<std::uint8_t> rgba(4 * result.coverage.data().size());
    for (size_t p = 0; p < result.coverage.data().size(); ++p) {
      for (size_t c = 0; c < 3; ++c) rgba[4 * p + c] = result.image.data()[3 * p + c];
      const bool guessed = result.coverage.data()[p] == 0 && depth.data()[p] > 0;
      rgba[4 * p + 3] = guessed ? kGuessedAlpha : result.coverage.data()[p];
    }
    if (width != width_ || height != height_) {
      image_ = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA8, width, height, 1);
      depth_ = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_R32F, width, height, 1);
      width_ = width, height_ = height;
    }
    Bind(0, image_.name());
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, width, height, 1, GL_RGBA, GL_UNSIGNED_BYTE,
                    rgba.data());
    Bind(0, depth_.name());
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, width, height, 1, GL_RED, GL_FLOAT,
                    depth.data().data());
    return {image_.name(), depth_.name(), 0, 0, width, height, result.views_used, false};
  }

 private:
  ProgramCache programs_;
  VertexArray empty_array_;
  Texture image_, depth_;
  int width_ = 0, height_ = 0;
};

Compositor::Compositor(std::string shader_folder)
    : implementation_(std::make_unique<Implementation>(std::move(shader_folder))) {}
Compositor::~Compositor() = default;

void Compositor::Composite(const DrawnPicture& picture, const DepthProjection& projection) {
  implementation_->Composite(picture, projection);
}

DrawnPicture Compositor::Upload(const RenderResult& result) {
  return implementation_->Upload(result, result.depth.grid());
}

DrawnPicture Compositor::UploadFilled(const RenderResult& result, const Grid<float>& depth) {
  return implementation_->Upload(result, depth);
}

}  // namespace dtr::gl
