#include "dtr/gl/resolve.h"

#include <algorithm>
#include <array>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/render/blend_weights.h"

namespace dtr::gl {
namespace {

#include "dtr/gl/shaders/view_block.glsl"

static_assert(sizeof(ViewBlock) == 11 * 16, "std430: eleven vec4");

// Unit 0 has the layers; the arrays of images and depths follow.
constexpr int kMaxImageArrays = StateGuard::kTextureUnits - 1;
// Variants of the resolving shader hold so many views, doubled until all fit.
constexpr int kMinViews = 8;
// As in resolve.comp: pixels of a side of a group, bindings.
constexpr int kGroupPx = 8;
constexpr GLuint kViewsBinding = 0, kResolveDepthBinding = 2;

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

int RoomFor(int views) {
  int room = kMinViews;
  while (room < views) room *= 2;
  return room;
}

/// What both methods need to know of a view; slots are set by the caller.
ViewBlock BlockOf(const View& view, const ViewPlacement& placed, double cut_factor,
                  const RenderOptions& options) {
  ViewBlock block;
  block.row_x = Row(placed.rotation.row(0), placed.translation.x());
  block.row_y = Row(placed.rotation.row(1), placed.translation.y());
  block.row_z = Row(placed.rotation.row(2), placed.translation.z());
  const Eigen::Vector4d camera = Intrinsics(view.camera);
  block.camera = Row(camera.head<3>(), camera.w());
  const InverseDepthThresholds thresholds = ThresholdsOf(view, options);
  block.limits = Row({static_cast<double>(view.image.width()),
                      static_cast<double>(view.image.height()), thresholds.delta},
                     0);
  block.stored_depth = {0, static_cast<float>(1 / placed.near_z),
                        static_cast<float>(thresholds.pixel), 0};
  block.fading = {static_cast<float>(cut_factor), static_cast<float>(placed.fading.gain),
                  static_cast<float>(placed.fading.offset), static_cast<float>(placed.clipped)};
  return block;
}

/// SPEC 5.3: sample (i, j)'s centre is at (i + 0.5, j + 0.5) of the grid that shaders see.
void SetDepthGrid(const View& view, const ViewStore::Deferred& deferred, const LayerSize& layer,
                  int slot, ViewBlock& block) {
  const PinholeCamera camera = view.DepthCamera();
  const double step = deferred.step;
  const auto centre = [&](double c) { return (c - deferred.offset - 0.5) / step + 0.5; };
  block.depth_grid = Row({camera.fx_px() / step, camera.fy_px() / step, centre(camera.cx_px())},
                         centre(camera.cy_px()));
  block.stored_depth[0] = static_cast<float>(deferred.depth_offset);
  block.stored_depth[1] = static_cast<float>(deferred.depth_factor);
  block.limits[3] = static_cast<float>(deferred.largest_bits);
  block.depth_slot = {slot, deferred.depth.layer, 0, 0};
  block.map = Row({1.0 / layer.width_px, 1.0 / layer.height_px, 0.5 * deferred.columns},
                  0.5 * deferred.rows);
}

void BindArrays(const Uniforms& set, const std::string& name, const std::vector<int>& arrays,
                int first_unit, const ViewStore& store) {
  for (size_t slot = 0; slot < arrays.size(); ++slot) {
    const int unit = first_unit + static_cast<int>(slot);
    set.Set((name + "[" + std::to_string(slot) + "]").c_str(), unit);
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    glBindTexture(GL_TEXTURE_2D_ARRAY, store.texture_array(arrays[slot]));
  }
}

/// The image units of resolve.comp.
void WriteInto(const Targets& targets) {
  const std::array<std::pair<GLuint, GLenum>, 3> results = {{{targets.image.name(), GL_RGBA8},
                                                             {targets.depth.name(), GL_R32F},
                                                             {targets.marks.name(), GL_RGBA8UI}}};
  for (GLuint i = 0; i < results.size(); ++i) {
    glBindImageTexture(i, results[i].first, 0, GL_TRUE, 0, GL_WRITE_ONLY, results[i].second);
  }
}

}  // namespace

Resolver::Resolver() : view_buffer_(Buffer::Make()) {
  glGetIntegerv(GL_MAX_UNIFORM_BLOCK_SIZE, &max_uniform_bytes_);
}

bool Resolver::BlocksFitUniforms(int views) const {
  return static_cast<size_t>(RoomFor(views)) * sizeof(ViewBlock) <=
         static_cast<size_t>(max_uniform_bytes_);
}

int Resolver::SlotOf(std::vector<int>& bound, int array) const {
  const auto found = std::find(bound.begin(), bound.end(), array);
  if (found != bound.end()) return static_cast<int>(found - bound.begin());
  if (image_arrays_.size() + depth_arrays_.size() == static_cast<size_t>(kMaxImageArrays)) {
    // Sizes are few (LayerSizes): there are more arrays where one would be larger than 1 GiB.
    throw Error("OpenGL: expected the images and depth maps of one image in at most " +
                std::to_string(kMaxImageArrays) +
                " texture arrays of up to 1 GiB, found more; use `renderer` cpu or simd, fewer "
                "`views` or a "
                "smaller `gpu_memory`");
  }
  bound.push_back(array);
  return static_cast<int>(bound.size()) - 1;
}

void Resolver::SetViews(const RenderFrame& frame, ViewStore& store) {
  image_arrays_.clear();
  depth_arrays_.clear();
  std::vector<ViewBlock> blocks;
  for (size_t i = 0; i < frame.views.size(); ++i) {
    const View& view = *frame.views[i];
    const ImageSlot slot = store.ImageOf(view);
    ViewBlock block = BlockOf(view, frame.placements[i], frame.cut_factors[i], frame.options);
    block.image = {SlotOf(image_arrays_, slot.array), slot.layer, view.mask.empty() ? 0 : 1, 0};
    if (frame.deferred()) {
      const ViewStore::Deferred& deferred = *store.DeferredOf(view);
      SetDepthGrid(view, deferred, store.SizeOf(deferred.depth),
                   SlotOf(depth_arrays_, deferred.depth.array), block);
    }
    blocks.push_back(block);
  }
  blocks.resize(static_cast<size_t>(RoomFor(static_cast<int>(blocks.size()))), ViewBlock{});
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, view_buffer_.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(blocks.size() * sizeof(ViewBlock)),
               blocks.data(), GL_STREAM_DRAW);
}

const Program& Resolver::ProgramFor(const RenderFrame& frame, ProgramCache& programs) const {
  const int views = static_cast<int>(frame.views.size());
  const auto define = [](const char* name, auto value) {
    return std::string(name) + " " + std::to_string(static_cast<long>(value));
  };
  return programs.Get(
      {{GL_COMPUTE_SHADER, "resolve.comp"}},
      {define("MAX_VIEWS", RoomFor(views)), define("IMAGE_ARRAYS", image_arrays_.size()),
       define("DEPTH_ARRAYS", depth_arrays_.size()),
       define("BLEND", BlendNumber(frame.options.blend)),
       define("VIEWS_IN_UNIFORMS", BlocksFitUniforms(views)), define("PER_PIXEL", frame.per_pixel),
       define("LINEAR_LIGHT", frame.options.blend_in_linear_light),
       define("CLIPPED", frame.AnyClipped()),
       define("EXPOSED", frame.exposure != Eigen::Vector3d::Ones())});
}

void Resolver::Draw(const RenderFrame& frame, const Band& band, const ViewStore& store,
                    ProgramCache& programs, const Targets& targets, GLuint coarse_depth) {
  const RenderOptions& options = frame.options;
  const BlendParameters blend = BlendParametersOf(options, frame.novel.fx_px(), frame.scene.bounds);
  const int views = static_cast<int>(frame.views.size());
  const Uniforms set(ProgramFor(frame, programs));
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
  set.Set("least_inverse_depth", blend.least_inverse_depth);
  set.Set("width_px", frame.novel.width_px());
  set.Set("rows", band.count);
  if (frame.exposure != Eigen::Vector3d::Ones()) set.Set("exposure", frame.exposure);
  set.Set("layers", 0);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D_ARRAY, targets.layers.name());
  BindArrays(set, "images", image_arrays_, 1, store);
  BindArrays(set, "depths", depth_arrays_, 1 + static_cast<int>(image_arrays_.size()), store);
  glActiveTexture(GL_TEXTURE0);
  glBindBufferBase(BlocksFitUniforms(views) ? GL_UNIFORM_BUFFER : GL_SHADER_STORAGE_BUFFER,
                   kViewsBinding, view_buffer_.name());
  if (frame.deferred()) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, kResolveDepthBinding, coarse_depth);
  }
  WriteInto(targets);
  glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);  // who still reads the last image
  const auto groups = [](int pixels) { return static_cast<GLuint>((pixels - 1) / kGroupPx + 1); };
  glDispatchCompute(groups(frame.novel.width_px()), groups(band.count), 1);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT |
                  GL_TEXTURE_UPDATE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
}

}  // namespace dtr::gl
