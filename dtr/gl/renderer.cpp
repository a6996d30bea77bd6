#include "dtr/gl/renderer.h"

#include <algorithm>
#include <map>
#include <set>

#include "dtr/base/error.h"
#include "dtr/gl/drawing.h"
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

static_assert(sizeof(ViewBlock) == 9 * 16, "std430: nine vec4");

constexpr int kOldestVersion = 43;
// Unit 0 has the layers; the arrays of images and depths follow.
constexpr int kMaxImageArrays = StateGuard::kTextureUnits - 1;
// Beyond this many pixels of disparity from the coarse depth a view shows another surface.
constexpr double kSameSurfacePx = 2;
// Invocations in a row of work groups of coarse_depth.glsl: the least limit that a driver may have.
constexpr int kGroupSize = 64, kGroupsPerRow = 65535;
// Variants of the resolving shader hold so many views, doubled until all fit.
constexpr int kFewestViews = 8;

std::array<float, 4> Row(const Eigen::Vector3d& row, double last) {
  return {static_cast<float>(row.x()), static_cast<float>(row.y()), static_cast<float>(row.z()),
          static_cast<float>(last)};
}

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
  std::vector<int> image_arrays, depth_arrays;  ///< store numbers, by the slot they are bound to
  bool deferred() const { return options.method == RenderMethod::kDeferred; }
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
    glGetIntegerv(GL_MAX_UNIFORM_BLOCK_SIZE, &max_uniform_bytes_);
    empty_array_ = VertexArray::Make();
    view_buffer_ = Buffer::Make();
  }

  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) {
    CheckRenderOptions(options);
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
    Frame frame{scene, novel, options, selection.per_pixel, {}, {}, {}, {}};
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
    int views = static_cast<int>(frame.views.size());
    GLint max_layers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
    if (views > max_layers) {
      throw Error("OpenGL: expected at most " + std::to_string(max_layers) +
                  " candidate views on this driver, found " + std::to_string(views) +
                  "; use --renderer cpu or --exclude");
    }
    if (frame.deferred()) {
      store_.PrepareDeferred(frame.views, frame.options);
      // What no sample is left of at this resolution shows nothing.
      for (size_t i = frame.views.size(); i-- > 0;) {
        if (store_.DeferredOf(*frame.views[i]) != nullptr) continue;
        frame.views.erase(frame.views.begin() + static_cast<std::ptrdiff_t>(i));
        frame.placements.erase(frame.placements.begin() + static_cast<std::ptrdiff_t>(i));
      }
      if (frame.views.empty()) return;
    } else {
      store_.Prepare(frame.views, frame.options);
    }
    UploadBlocks(frame);
    const int width = frame.novel.width_px(), height = frame.novel.height_px();
    views = static_cast<int>(frame.views.size());
    const int layers = frame.deferred() ? 1 : views;
    const size_t row_bytes =
        sizeof(float) * static_cast<size_t>(width) * static_cast<size_t>(layers);
    const int rows = static_cast<int>(
        std::clamp<size_t>(settings_.layer_bytes / row_bytes, 1, static_cast<size_t>(height)));
    targets_.Fit(width, rows, layers);
    for (Band band; band.first < height; band.first += band.count) {
      band.count = std::min(rows, height - band.first);
      if (frame.deferred()) {
        DrawCoarseDepth(frame, band);
      } else {
        for (int i = 0; i < views; ++i) DrawView(frame, band, i);
      }
      Resolve(frame, band);
      ReadBack(band, result);
    }
    ThrowOnError("drawing");
  }

  static int RoomFor(int views) {
    int room = kFewestViews;
    while (room < views) room *= 2;
    return room;
  }
  bool BlocksFitUniforms(int views) const {
    return static_cast<size_t>(RoomFor(views)) * sizeof(ViewBlock) <=
           static_cast<size_t>(max_uniform_bytes_);
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
      RenderOptions same_surface = frame.options;
      same_surface.delta_px = kSameSurfacePx;
      const InverseDepthThresholds thresholds = ThresholdsOf(view, frame.options);
      block.gain = Row(view.gain, ThresholdsOf(view, same_surface).delta);
      block.limits = Row({static_cast<double>(view.image.width()),
                          static_cast<double>(view.image.height()), thresholds.delta},
                         thresholds.depth_break);
      block.image = {SlotOf(frame, frame.image_arrays, slot.array), slot.layer,
                     view.mask.empty() ? 0 : 1, 0};
      if (frame.deferred()) SetDepthGrid(frame, view, block);
      blocks.push_back(block);
    }
    blocks.resize(static_cast<size_t>(RoomFor(static_cast<int>(blocks.size()))), ViewBlock{});
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, view_buffer_.name());
    glBufferData(GL_SHADER_STORAGE_BUFFER,
                 static_cast<GLsizeiptr>(blocks.size() * sizeof(ViewBlock)), blocks.data(),
                 GL_STREAM_DRAW);
  }

  /// SPEC 5.2: sample (i, j)'s centre is at (i + 0.5, j + 0.5) of the grid that shaders see.
  void SetDepthGrid(Frame& frame, const View& view, ViewBlock& block) {
    const ViewStore::Deferred& deferred = *store_.DeferredOf(view);
    const PinholeCamera camera = view.DepthCamera();
    const double step = deferred.step;
    const auto centre = [&](double c) { return (c - deferred.offset - 0.5) / step + 0.5; };
    block.depth_grid = Row({camera.fx_px() / step, camera.fy_px() / step, centre(camera.cx_px())},
                           centre(camera.cy_px()));
    block.depth_slot = {SlotOf(frame, frame.depth_arrays, deferred.depth.array),
                        deferred.depth.layer, deferred.columns, deferred.rows};
  }

  static int SlotOf(const Frame& frame, std::vector<int>& bound, int array) {
    const auto found = std::find(bound.begin(), bound.end(), array);
    if (found != bound.end()) return static_cast<int>(found - bound.begin());
    if (frame.image_arrays.size() + frame.depth_arrays.size() ==
        static_cast<size_t>(kMaxImageArrays)) {
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

  /// SPEC 5.1: the nearest surface of all views, from their coarse surfaces.
  void DrawCoarseDepth(const Frame& frame, const Band& band) {
    const auto pixels = static_cast<GLsizeiptr>(targets_.width) * targets_.rows;
    if (!depth_buffer_) depth_buffer_ = Buffer::Make();
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, depth_buffer_.name());
    if (depth_pixels_ != pixels) {
      glBufferData(GL_SHADER_STORAGE_BUFFER, pixels * GLsizeiptr{sizeof(GLuint)}, nullptr,
                   GL_STREAM_COPY);
      depth_pixels_ = pixels;
    }
    glClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, depth_buffer_.name());
    for (const char* file : {"coarse_blocks.comp", "coarse_splats.comp"}) {
      const bool splats = std::string(file) == "coarse_splats.comp";
      const Uniforms set(ProgramOf({{GL_COMPUTE_SHADER, file}}, {}));
      for (size_t i = 0; i < frame.views.size(); ++i) {
        const View& view = *frame.views[i];
        const CoarseGeometry& coarse = store_.DeferredOf(view)->coarse;
        const int count = splats ? coarse.splat_count : coarse.block_count;
        if (count == 0) continue;
        set.Set("depth_camera", Intrinsics(view.DepthCamera()));
        set.Set("novel_from_view", frame.placements[i].rotation);
        set.Set("view_centre", frame.placements[i].translation);
        set.Set("near_z", frame.placements[i].near_z);
        set.Set("novel_camera", Intrinsics(frame.novel));
        set.Set("width_px", frame.novel.width_px());
        set.Set("first_row", band.first);
        set.Set("rows", band.count);
        set.Set("primitive_count", count);
        set.Set("sample_step", static_cast<double>(frame.options.resolution));
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1,
                         splats ? coarse.splats.name() : coarse.blocks.name());
        const int groups = (count + kGroupSize - 1) / kGroupSize;
        glDispatchCompute(static_cast<GLuint>(std::min(groups, kGroupsPerRow)),
                          static_cast<GLuint>((groups + kGroupsPerRow - 1) / kGroupsPerRow), 1);
      }
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  }

  /// SPEC 4.2 to 4.7: one pass over the pixels.
  void Resolve(const Frame& frame, const Band& band) {
    const RenderOptions& options = frame.options;
    const BlendParameters blend = BlendParametersOf(options, frame.novel.fx_px());
    const int views = static_cast<int>(frame.views.size());
    const int room = RoomFor(views);
    const int arrays = static_cast<int>(frame.image_arrays.size());
    const Program& program =
        ProgramOf({{GL_VERTEX_SHADER, "full_screen.vert"}, {GL_FRAGMENT_SHADER, "resolve.frag"}},
                  {"MAX_VIEWS " + std::to_string(room), "IMAGE_ARRAYS " + std::to_string(arrays),
                   "DEPTH_ARRAYS " + std::to_string(frame.depth_arrays.size()),
                   "BLEND " + std::to_string(BlendNumber(options.blend)),
                   std::string("VIEWS_IN_UNIFORMS ") + (BlocksFitUniforms(views) ? "1" : "0"),
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
    set.Set("width_px", frame.novel.width_px());
    set.Set("layers", 0);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D_ARRAY, targets_.layers.name());
    BindArrays(set, "images", frame.image_arrays, 1);
    BindArrays(set, "depths", frame.depth_arrays, 1 + arrays);
    glActiveTexture(GL_TEXTURE0);
    glBindBufferBase(BlocksFitUniforms(views) ? GL_UNIFORM_BUFFER : GL_SHADER_STORAGE_BUFFER, 0,
                     view_buffer_.name());
    glBindFramebuffer(GL_FRAMEBUFFER, targets_.result_framebuffer.name());
    glViewport(0, 0, frame.novel.width_px(), band.count);
    glBindVertexArray(empty_array_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }

  void BindArrays(const Uniforms& set, const std::string& name, const std::vector<int>& arrays,
                  int first_unit) const {
    for (size_t slot = 0; slot < arrays.size(); ++slot) {
      const int unit = first_unit + static_cast<int>(slot);
      set.Set((name + "[" + std::to_string(slot) + "]").c_str(), unit);
      glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
      glBindTexture(GL_TEXTURE_2D_ARRAY, store_.texture_array(arrays[slot]));
    }
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
  GLint max_uniform_bytes_ = 0;
  ViewStore store_;
  std::map<std::string, Program> programs_;
  Targets targets_;
  VertexArray empty_array_;
  Buffer view_buffer_, depth_buffer_;
  GLsizeiptr depth_pixels_ = 0;
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
