#include "dtr/gl/renderer.h"

#include <algorithm>
#include <map>
#include <set>

#include "dtr/base/error.h"
#include "dtr/gl/objects.h"
#include "dtr/gl/program.h"
#include "dtr/gl/view_store.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/frame.h"
#include "dtr/render/valid_views.h"

namespace dtr::gl {
namespace {

#include "dtr/gl/shaders/view_block.glsl"

static_assert(sizeof(ViewBlock) == 7 * 16, "std430: seven vec4");

constexpr int kOldestVersion = 43;
// Unit 0 has the layers; images follow.
constexpr int kMaxImageArrays = StateGuard::kTextureUnits - 1;
// Variants of the resolving shader hold so many views, doubled until all fit.
constexpr int kFewestViews = 8;

std::array<float, 4> Row(const Eigen::Vector3d& row, double last) {
  return {static_cast<float>(row.x()), static_cast<float>(row.y()), static_cast<float>(row.z()),
          static_cast<float>(last)};
}

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

Eigen::Vector4d Intrinsics(const PinholeCamera& camera) {
  return {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()};
}

/// A texture to draw into, of one band's size.
Texture MakeTarget(GLenum target, GLenum format, int width, int height, int layers) {
  Texture texture = Texture::Make();
  glBindTexture(target, texture.name());
  if (target == GL_TEXTURE_2D_ARRAY) {
    glTexStorage3D(target, 1, format, width, height, layers);
  } else {
    glTexStorage2D(target, 1, format, width, height);
  }
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

/// Everything drawn into, for bands of one size; kept from frame to frame.
struct Targets {
  int width = 0, rows = 0, layer_count = 0;
  Texture layers, image, depth, marks;
  Framebuffer layer_framebuffer, result_framebuffer;

  void Fit(int new_width, int new_rows, int new_layers) {
    if (width == new_width && rows == new_rows && layer_count >= new_layers) return;
    *this = Targets{};
    width = new_width, rows = new_rows, layer_count = new_layers;
    layers = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_R32F, width, rows, layer_count);
    image = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA8, width, rows, 1);
    depth = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_R32F, width, rows, 1);
    marks = MakeTarget(GL_TEXTURE_2D_ARRAY, GL_RGBA8UI, width, rows, 1);
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
          "use --renderer cpu");
    }
    ThrowOnError("a picture of " + std::to_string(width) + "x" + std::to_string(rows) +
                 " pixels from " + std::to_string(layer_count) + " views");
  }
};

int BlendNumber(BlendWeight blend) { return static_cast<int>(blend); }  // as in weights.glsl
static_assert(static_cast<int>(BlendWeight::kCosine) == 0 &&
              static_cast<int>(BlendWeight::kExponential) == 1 &&
              static_cast<int>(BlendWeight::kAngle) == 2 &&
              static_cast<int>(BlendWeight::kInverseAngle) == 3 &&
              static_cast<int>(BlendWeight::kKNearest) == 4);

/// One picture: the views that take part, in canonical order.
struct Frame {
  const RenderScene& scene;
  const PinholeCamera& novel;
  const RenderOptions& options;
  bool per_pixel = false;
  std::vector<const View*> views;
  std::vector<ViewPlacement> placements;
  std::vector<int> image_arrays;  ///< store numbers, by the slot they are bound to
};

/// Rows [first, first + count) of the picture.
struct Band {
  int first = 0, count = 0;
};

}  // namespace

class Renderer::Implementation {
 public:
  explicit Implementation(RendererSettings settings) : settings_(std::move(settings)) {
    if (epoxy_gl_version() < kOldestVersion || !epoxy_is_desktop_gl()) {
      throw Error("OpenGL: expected a current context of version 4.3 or newer, found " +
                  std::to_string(epoxy_gl_version()) + " (tens); use --renderer cpu");
    }
    GLint max_size = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
    max_target_px_ = max_size;
    empty_array_ = VertexArray::Make();
    view_buffer_ = Buffer::Make();
  }

  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) {
    CheckRenderOptions(options);
    if (options.method != RenderMethod::kTwoPass) {
      throw UsageError("--method: expected two-pass, found deferred");
    }
    CheckNovelCamera(novel, novel_from_world);
    RenderResult result = EmptyResult(novel);
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    result.views_used = selection.views;
    if (selection.views.empty()) return result;
    if (novel.width_px() > max_target_px_ || novel.height_px() > max_target_px_) {
      throw Error("OpenGL: expected a picture of at most " + std::to_string(max_target_px_) +
                  " pixels a side on this driver, found " + std::to_string(novel.width_px()) + "x" +
                  std::to_string(novel.height_px()) + "; use --renderer cpu");
    }
    Draw(MakeFrame(scene, novel, novel_from_world, options, selection), result);
    result.coverage_share = CoverageShare(result.coverage);
    if (options.fill_holes) FillHolesFromViews(scene, novel, novel_from_world, options, result);
    return result;
  }

  void Forget() { store_.Clear(); }

 private:
  static Frame MakeFrame(const RenderScene& scene, const PinholeCamera& novel,
                         const Pose& novel_from_world, const RenderOptions& options,
                         const ViewSelection& selection) {
    Frame frame{scene, novel, options, selection.per_pixel, {}, {}, {}};
    for (const int index : CanonicalOrder(scene, selection.views)) {
      const View& view = *scene.views[static_cast<size_t>(index)];
      frame.views.push_back(&view);
      frame.placements.push_back(PlaceView(view, novel_from_world));
    }
    return frame;
  }

  void Draw(Frame frame, RenderResult& result) {
    while (glGetError() != GL_NO_ERROR) {  // the caller's own errors are not ours
    }
    const StateGuard guard;
    const int views = static_cast<int>(frame.views.size());
    GLint max_layers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
    if (views > max_layers) {
      throw Error("OpenGL: expected at most " + std::to_string(max_layers) +
                  " candidate views on this driver, found " + std::to_string(views) +
                  "; use --renderer cpu or --exclude");
    }
    store_.Prepare(frame.views, frame.options);
    UploadBlocks(frame);
    const int width = frame.novel.width_px(), height = frame.novel.height_px();
    const size_t row_bytes =
        sizeof(float) * static_cast<size_t>(width) * static_cast<size_t>(views);
    const int rows = static_cast<int>(
        std::clamp<size_t>(settings_.layer_bytes / row_bytes, 1, static_cast<size_t>(height)));
    targets_.Fit(width, rows, views);
    for (Band band; band.first < height; band.first += band.count) {
      band.count = std::min(rows, height - band.first);
      for (int i = 0; i < views; ++i) DrawView(frame, band, i);
      Resolve(frame, band);
      ReadBack(band, result);
    }
    ThrowOnError("drawing");
  }

  /// What the resolving shader knows of each view; puts the images on the GPU.
  void UploadBlocks(Frame& frame) {
    std::map<std::pair<int, int>, int> views_of_size;
    for (const View* view : frame.scene.views) {
      ++views_of_size[{view->image.width(), view->image.height()}];
    }
    std::vector<ViewBlock> blocks;
    for (size_t i = 0; i < frame.views.size(); ++i) {
      const View& view = *frame.views[i];
      const ViewPlacement& placed = frame.placements[i];
      const ImageSlot slot =
          store_.ImageOf(view, views_of_size[{view.image.width(), view.image.height()}]);
      ViewBlock block;
      block.row_x = Row(placed.rotation.row(0), placed.translation.x());
      block.row_y = Row(placed.rotation.row(1), placed.translation.y());
      block.row_z = Row(placed.rotation.row(2), placed.translation.z());
      const Eigen::Vector4d camera = Intrinsics(view.camera);
      block.camera = Row(camera.head<3>(), camera.w());
      block.gain = Row(view.gain, 0);
      block.limits =
          Row({static_cast<double>(view.image.width()), static_cast<double>(view.image.height()),
               ThresholdsOf(view, frame.options).delta},
              0);
      block.image = {SlotOf(frame, slot.array), slot.layer, view.mask.empty() ? 0 : 1, 0};
      blocks.push_back(block);
    }
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, view_buffer_.name());
    glBufferData(GL_SHADER_STORAGE_BUFFER,
                 static_cast<GLsizeiptr>(blocks.size() * sizeof(ViewBlock)), blocks.data(),
                 GL_STREAM_DRAW);
  }

  static int SlotOf(Frame& frame, int array) {
    std::vector<int>& bound = frame.image_arrays;
    const auto found = std::find(bound.begin(), bound.end(), array);
    if (found != bound.end()) return static_cast<int>(found - bound.begin());
    if (bound.size() == static_cast<size_t>(kMaxImageArrays)) {
      throw Error("OpenGL: expected images of at most " + std::to_string(kMaxImageArrays) +
                  " sizes in one picture (or 1 GiB each), found more; use --renderer cpu or fewer "
                  "--views");
    }
    bound.push_back(array);
    return static_cast<int>(bound.size()) - 1;
  }

  const Program& ProgramOf(const std::vector<Stage>& stages,
                           const std::vector<std::string>& defines) {
    std::string key = stages.back().file;
    for (const std::string& define : defines) key += "|" + define;
    const auto found = programs_.find(key);
    if (found != programs_.end()) return found->second;
    return programs_.emplace(key, BuildProgram(stages, defines, settings_.shader_folder))
        .first->second;
  }

  /// SPEC 2, 3 and 4.2: the view's nearest fragments, into its layer.
  void DrawView(const Frame& frame, const Band& band, int index) {
    const auto i = static_cast<size_t>(index);
    const View& view = *frame.views[i];
    const bool splats = frame.options.primitive == Primitive::kSplat;
    const Geometry& geometry = store_.GeometryOf(view, frame.options);
    glBindFramebuffer(GL_FRAMEBUFFER, targets_.layer_framebuffer.name());
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, targets_.layers.name(), 0,
                              index);
    const int width = frame.novel.width_px(), height = frame.novel.height_px();
    // Row 0 of a target is the picture's top row: no flip, and y grows downwards as in SPEC.
    glViewport(0, -band.first, width, height);
    const float nothing[4] = {0, 0, 0, 0};
    glDisable(GL_BLEND);
    glClearBufferfv(GL_COLOR, 0, nothing);
    if (geometry.index_count == 0) return;

    const Program& program =
        ProgramOf(splats ? std::vector<Stage>{{GL_VERTEX_SHADER, "splat.vert"},
                                              {GL_FRAGMENT_SHADER, "splat.frag"}}
                         : std::vector<Stage>{{GL_VERTEX_SHADER, "mesh.vert"},
                                              {GL_FRAGMENT_SHADER, "mesh.frag"}},
                  {});
    const Uniforms set(program);
    const ViewPlacement& placed = frame.placements[i];
    const PinholeCamera& novel = frame.novel;
    set.Set("depth_camera", Intrinsics(view.DepthCamera()));
    set.Set("novel_from_view", placed.rotation);
    set.Set("view_centre", placed.translation);
    set.Set("near_z", placed.near_z);
    set.Set("largest_inverse_depth", 1 / placed.near_z);
    set.Set("clip_from_cam",
            Eigen::Vector4d(2 * novel.fx_px() / width, 2 * novel.fy_px() / height,
                            2 * novel.cx_px() / width - 1, 2 * novel.cy_px() / height - 1));
    set.Set("novel_camera", Intrinsics(novel));
    set.Set("novel_size", width, height);
    set.Set("sample_step", static_cast<double>(frame.options.resolution));
    set.Set("point_size", frame.options.point_size);
    set.Set("first_row", static_cast<double>(band.first));
    glEnable(GL_BLEND);
    glBlendEquation(GL_MAX);
    if (splats) {
      glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, geometry.points.name());
    } else {  // SPEC 2.4: what turns the other way shows a surface's back
      glEnable(GL_CULL_FACE);
      glCullFace(GL_BACK);
      glFrontFace(GL_CCW);
    }
    glBindVertexArray(geometry.array.name());
    glDrawElements(GL_TRIANGLES, geometry.index_count, GL_UNSIGNED_INT, nullptr);
    glDisable(GL_CULL_FACE);
    glDisable(GL_BLEND);
  }

  /// SPEC 4.2 to 4.7: one pass over the pixels.
  void Resolve(const Frame& frame, const Band& band) {
    const RenderOptions& options = frame.options;
    const BlendParameters blend = BlendParametersOf(options, frame.novel.fx_px());
    const int views = static_cast<int>(frame.views.size());
    int room = kFewestViews;
    while (room < views) room *= 2;
    const int arrays = static_cast<int>(frame.image_arrays.size());
    const Program& program =
        ProgramOf({{GL_VERTEX_SHADER, "full_screen.vert"}, {GL_FRAGMENT_SHADER, "resolve.frag"}},
                  {"MAX_VIEWS " + std::to_string(room), "IMAGE_ARRAYS " + std::to_string(arrays),
                   "BLEND " + std::to_string(BlendNumber(options.blend)),
                   std::string("PER_PIXEL ") + (frame.per_pixel ? "1" : "0"),
                   std::string("LINEAR_LIGHT ") + (options.blend_in_linear_light ? "1" : "0")});
    const Uniforms set(program);
    set.Set("view_count", views);
    set.Set("nearest_views", options.views);
    set.Set("novel_camera", Intrinsics(frame.novel));
    set.Set("first_row", static_cast<double>(band.first));
    set.Set("absolute_delta", options.absolute_delta.value_or(-1.0));
    set.Set("exponent", blend.exponent);
    set.Set("falloff", blend.falloff);
    set.Set("blend_k", blend.blend_k);
    set.Set("max_angle_rad", blend.max_angle_rad);
    set.Set("pixel_angle_rad", blend.pixel_angle_rad);
    set.Set("layers", 0);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D_ARRAY, targets_.layers.name());
    for (int slot = 0; slot < arrays; ++slot) {
      set.Set(("images[" + std::to_string(slot) + "]").c_str(), slot + 1);
      glActiveTexture(GL_TEXTURE1 + static_cast<GLenum>(slot));
      glBindTexture(GL_TEXTURE_2D_ARRAY,
                    store_.image_array(frame.image_arrays[static_cast<size_t>(slot)]));
    }
    glActiveTexture(GL_TEXTURE0);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, view_buffer_.name());
    glBindFramebuffer(GL_FRAMEBUFFER, targets_.result_framebuffer.name());
    glViewport(0, 0, frame.novel.width_px(), band.count);
    glBindVertexArray(empty_array_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  void ReadBack(const Band& band, RenderResult& result) {
    const int width = targets_.width;
    const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(band.count);
    std::vector<std::uint8_t> image(4 * pixels), marks(4 * pixels);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, targets_.result_framebuffer.name());
    const auto read = [&](GLenum attachment, GLenum format, GLenum type, void* data) {
      glReadBuffer(attachment);
      glReadPixels(0, 0, width, band.count, format, type, data);
    };
    read(GL_COLOR_ATTACHMENT0, GL_RGBA, GL_UNSIGNED_BYTE, image.data());
    read(GL_COLOR_ATTACHMENT1, GL_RED, GL_FLOAT, result.depth.row(band.first));
    read(GL_COLOR_ATTACHMENT2, GL_RGBA_INTEGER, GL_UNSIGNED_BYTE, marks.data());
    const size_t first = static_cast<size_t>(band.first) * static_cast<size_t>(width);
    for (size_t p = 0; p < pixels; ++p) {
      for (size_t c = 0; c < 3; ++c) result.image.data()[3 * (first + p) + c] = image[4 * p + c];
      result.coverage.data()[first + p] = image[4 * p + 3];
      result.view_count.data()[first + p] = marks[4 * p];
      result.delta_border.data()[first + p] = marks[4 * p + 1];
    }
  }

  const RendererSettings settings_;
  int max_target_px_ = 0;
  ViewStore store_;
  std::map<std::string, Program> programs_;
  Targets targets_;
  VertexArray empty_array_;
  Buffer view_buffer_;
};

Renderer::Renderer(RendererSettings settings)
    : implementation_(std::make_unique<Implementation>(std::move(settings))) {}
Renderer::~Renderer() = default;

RenderResult Renderer::Render(const RenderScene& scene, const PinholeCamera& novel,
                              const Pose& novel_from_world, const RenderOptions& options) {
  return implementation_->Render(scene, novel, novel_from_world, options);
}

void Renderer::Forget() { implementation_->Forget(); }

}  // namespace dtr::gl
