#include "dtr/gl/quick_resolve.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/render/blend_weights.h"

namespace dtr::gl {
namespace {

#include "dtr/gl/shaders/quick_block.glsl"

static_assert(sizeof(QuickBlock) == 8 * 16, "std140: eight vec4");

// As in quick_pixels.glsl.
constexpr int kAcross = 4, kDown = 2;
constexpr GLuint kViewsBinding = 0, kCoarseDepthBinding = 2;
// exp(80) fits float32 and so does the sum of its like.
constexpr double kLargestLogWeight = 80;

std::array<float, 4> Vector(double x, double y, double z, double w) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z),
          static_cast<float>(w)};
}

/// Never 0 for any angle and within single precision, so that no logarithms need to be compared
/// (SPEC 4.6).
bool WeightsAreTame(const BlendParameters& blend) {
  if (blend.blend != BlendWeight::kInverseAngle && blend.blend != BlendWeight::kExponential) {
    return false;
  }
  for (const double angle : {0.0, std::numbers::pi}) {
    if (!(std::abs(LogWeight(blend, angle, 0)) <= kLargestLogWeight)) return false;
  }
  return true;
}

/// A sample then has a usable pixel of the image at its centre, and no colour is asked for whose
/// four pixels are all masked.
bool MaskNeedsNoTest(const View& view, const RenderOptions& options) {
  return view.mask.empty() || (view.depth_scale == 1 && options.resolution == 1);
}

/// The shader takes the first view's sizes for all; layers of one array may hold pictures of
/// several.
bool AreOfOneSize(const View& a, const View& b) {
  return a.image.width() == b.image.width() && a.image.height() == b.image.height() &&
         a.depth_scale == b.depth_scale;
}

QuickBlock BlockOf(const View& view, const ViewPlacement& placed, const RenderOptions& options,
                   const ViewStore::Deferred& deferred, const ViewStore& store,
                   const ImageSlot& image) {
  QuickBlock block;
  const PinholeCamera camera = view.DepthCamera();
  const double step = deferred.step, shift = deferred.offset + 0.5 - 0.5 * step;
  Eigen::Matrix3d grid_from_view;
  grid_from_view << camera.fx_px() / step, 0, (camera.cx_px() - shift) / step,  //
      0, camera.fy_px() / step, (camera.cy_px() - shift) / step,                //
      0, 0, 1;
  const Eigen::Matrix3d grid_from_novel = grid_from_view * placed.rotation.transpose();
  const Eigen::Vector3d away = -grid_from_novel * placed.translation;
  const auto row = [&](int i) {
    return Vector(grid_from_novel(i, 0), grid_from_novel(i, 1), grid_from_novel(i, 2), away[i]);
  };
  block.grid_x = row(0);
  block.grid_y = row(1);
  block.grid_z = row(2);
  const Eigen::Vector3d& centre = placed.translation;
  block.centre = Vector(centre.x(), centre.y(), centre.z(), centre.squaredNorm());
  const LayerSize depth_layer = store.SizeOf(deferred.depth), image_layer = store.SizeOf(image);
  block.map = Vector(1.0 / depth_layer.width_px, 1.0 / depth_layer.height_px,
                     0.5 * deferred.columns, 0.5 * deferred.rows);
  const InverseDepthThresholds thresholds = ThresholdsOf(view, options);
  block.stored = Vector(deferred.depth_offset, deferred.depth_factor, thresholds.depth_break,
                        thresholds.pixel);
  const double scale = view.depth_scale;
  const double x = scale / image_layer.width_px, y = scale / image_layer.height_px;
  block.colour = Vector(step * x, step * y, shift * x, shift * y);
  block.limits = Vector(thresholds.delta, image.layer, deferred.depth.layer, 0);
  return block;
}

}  // namespace

QuickResolver::QuickResolver()
    : empty_array_(VertexArray::Make()), view_buffer_(Buffer::Make()), pixels_(Buffer::Make()) {}

bool QuickResolver::SetViews(const Frame& frame, ViewStore& store) {
  const RenderOptions& options = frame.options;
  if (!frame.deferred() || frame.per_pixel || options.blend_in_linear_light ||
      options.absolute_delta || frame.views.size() > static_cast<size_t>(kMostViews) ||
      !WeightsAreTame(BlendParametersOf(options, frame.novel.fx_px()))) {
    return false;
  }
  std::vector<QuickBlock> blocks;
  for (size_t i = 0; i < frame.views.size(); ++i) {
    const View& view = *frame.views[i];
    if (!MaskNeedsNoTest(view, options)) return false;
    const ImageSlot image = store.ImageOf(view);
    const ViewStore::Deferred& deferred = *store.DeferredOf(view);
    if (i == 0) {
      image_array_ = image.array;
      depth_array_ = deferred.depth.array;
    }
    if (image.array != image_array_ || deferred.depth.array != depth_array_ ||
        !AreOfOneSize(view, *frame.views.front())) {
      return false;
    }
    blocks.push_back(BlockOf(view, frame.placements[i], options, deferred, store, image));
  }
  glBindBuffer(GL_UNIFORM_BUFFER, view_buffer_.name());
  glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(blocks.size() * sizeof(QuickBlock)),
               blocks.data(), GL_STREAM_DRAW);
  return true;
}

void QuickResolver::FitPacked(const Targets& targets) {
  const int columns = (targets.width + kAcross - 1) / kAcross;
  const int rows = (targets.rows + kDown - 1) / kDown;
  if (columns == columns_ && rows == rows_) return;
  columns_ = columns, rows_ = rows;
  packed_ = {MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA32UI, columns, rows, kDown),
             MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA32F, columns, rows, kDown),
             MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA32UI, columns, rows, kDown)};
  skip_ = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_DEPTH_COMPONENT32F, columns, rows, 1);
  framebuffer_ = Framebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  std::vector<GLenum> attachments;
  for (const Texture& texture : packed_) {
    for (int row = 0; row < kDown; ++row) {
      attachments.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachments.size()));
      glFramebufferTextureLayer(GL_FRAMEBUFFER, attachments.back(), texture.name(), 0, row);
    }
  }
  glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, skip_.name(), 0, 0);
  glDrawBuffers(static_cast<GLsizei>(attachments.size()), attachments.data());
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(
        "OpenGL: this driver cannot draw into RGBA32UI and RGBA32F at once; use --renderer cpu");
  }
  glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels_.name());
  glBufferData(GL_PIXEL_PACK_BUFFER, GLsizeiptr{4} * kAcross * kDown * columns * rows, nullptr,
               GL_STREAM_COPY);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  ThrowOnError("a picture of " + std::to_string(targets.width) + "x" +
               std::to_string(targets.rows) + " pixels");
}

/// Clears the results and leaves a depth test that passes over what shows no surface.
void QuickResolver::SkipEmpty(const Band& band, ProgramCache& programs, const Targets& targets) {
  const Uniforms set(programs.Get(
      {{GL_VERTEX_SHADER, "full_screen.vert"}, {GL_FRAGMENT_SHADER, "quick_skip.frag"}}, {}));
  set.Set("width_px", targets.width);
  set.Set("rows_px", band.count);
  const GLfloat zero[4] = {0, 0, 0, 0};
  const GLuint none[4] = {0, 0, 0, 0};
  for (GLint i = 0; i < kDown; ++i) {
    glClearBufferuiv(GL_COLOR, i, none);
    glClearBufferfv(GL_COLOR, kDown + i, zero);
    glClearBufferuiv(GL_COLOR, 2 * kDown + i, none);
  }
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_FALSE);
  glDepthFunc(GL_LESS);  // full_screen.vert draws at depth 1/2
}

void QuickResolver::Draw(const Frame& frame, const Band& band, const ViewStore& store,
                         ProgramCache& programs, const Targets& targets, GLuint coarse_depth) {
  FitPacked(targets);
  glBindBufferBase(GL_UNIFORM_BUFFER, kViewsBinding, view_buffer_.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kCoarseDepthBinding, coarse_depth);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, columns_, (band.count + kDown - 1) / kDown);
  glBindVertexArray(empty_array_.name());
  SkipEmpty(band, programs, targets);
  const BlendParameters blend = BlendParametersOf(frame.options, frame.novel.fx_px());
  std::string each = "FOR_EACH_VIEW(X)";
  for (size_t i = 0; i < frame.views.size(); ++i) each += " X(" + std::to_string(i) + ")";
  const bool inverse_square = blend.blend == BlendWeight::kInverseAngle && blend.blend_k == 2;
  const Uniforms set(programs.Get(
      {{GL_VERTEX_SHADER, "full_screen.vert"}, {GL_FRAGMENT_SHADER, "quick_resolve.frag"}},
      {each, "VIEWS " + std::to_string(frame.views.size()),
       "BLEND " + std::to_string(static_cast<int>(blend.blend)),
       std::string("INVERSE_SQUARE ") + (inverse_square ? "1" : "0")}));
  set.Set("width_px", targets.width);
  set.Set("rows_px", band.count);
  set.Set("novel_camera", Intrinsics(frame.novel));
  set.Set("first_row", static_cast<double>(band.first));
  set.Set("falloff", blend.falloff);
  set.Set("blend_k", blend.blend_k);
  set.Set("pixel_angle_rad", blend.pixel_angle_rad);
  set.Set("images", 0);
  set.Set("depths[0]", 1);
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D_ARRAY, store.texture_array(depth_array_));
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D_ARRAY, store.texture_array(image_array_));
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  Unpack(band, targets);
}

void QuickResolver::Unpack(const Band& band, const Targets& targets) {
  glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels_.name());
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, pixels_.name());
  // A texel is kAcross pixels; the rows of the kDown layers take turns.
  glPixelStorei(GL_PACK_ROW_LENGTH, kDown * columns_);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, kAcross * columns_);
  GLenum attachment = GL_COLOR_ATTACHMENT0;
  const auto copy = [&](GLenum format, GLenum type, const Texture& texture, GLenum texture_format,
                        GLenum texture_type) {
    for (int row = 0; row < kDown; ++row) {
      glReadBuffer(attachment++);
      glReadPixels(
          0, 0, columns_, (band.count + kDown - 1) / kDown, format, type,
          reinterpret_cast<void*>(std::uintptr_t{16} * static_cast<unsigned>(row * columns_)));
    }
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, targets.width, band.count, 1, texture_format,
                    texture_type, nullptr);
  };
  copy(GL_RGBA_INTEGER, GL_UNSIGNED_INT, targets.image, GL_RGBA, GL_UNSIGNED_BYTE);
  copy(GL_RGBA, GL_FLOAT, targets.depth, GL_RED, GL_FLOAT);
  copy(GL_RGBA_INTEGER, GL_UNSIGNED_INT, targets.marks, GL_RGBA_INTEGER, GL_UNSIGNED_BYTE);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
}

}  // namespace dtr::gl
