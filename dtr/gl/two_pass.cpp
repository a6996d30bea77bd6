#include "dtr/gl/two_pass.h"

#include <algorithm>
#include <cstdint>

#include "dtr/gl/driver.h"

namespace dtr::gl {
namespace {

// llvmpipe keeps what it has set up of an image (some 200 bytes a triangle) in memory until it is
// flushed: pieces that fit a core's cache cost a fifth less than whole meshes
// (docs/accuracy/SPEED.md). A GPU would only lose by it.
constexpr GLsizei kIndicesPerFlush = 3 * 50000;

void DrawTriangles(GLsizei index_count) {
  if (!DrawsOnProcessor()) {
    glDrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
    return;
  }
  for (GLsizei first = 0; first < index_count; first += kIndicesPerFlush) {
    const std::uintptr_t offset = sizeof(std::uint32_t) * static_cast<std::uintptr_t>(first);
    glDrawElements(GL_TRIANGLES, std::min(kIndicesPerFlush, index_count - first), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(offset));
    glFlush();
  }
}

void DrawView(const RenderFrame& frame, const Band& band, int index, ViewStore& store,
              ProgramCache& programs, const Targets& targets, bool clip_control) {
  const auto i = static_cast<size_t>(index);
  const View& view = *frame.views[i];
  const bool splats = frame.options.primitive == Primitive::kSplat;
  const Geometry& geometry = store.GeometryOf(view, frame.options);
  glBindFramebuffer(GL_FRAMEBUFFER, targets.layer_framebuffer.name());
  glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, targets.layers.name(), 0, index);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  const int width = frame.novel.width_px(), height = frame.novel.height_px();
  // Row 0 of a target is the image's top row: no flip, and y grows downwards as in SPEC.
  glViewport(0, -band.first, width, height);
  const float nothing = 0;
  glClearBufferfv(GL_DEPTH, 0, &nothing);
  if (geometry.index_count == 0) return;

  const Program& program = programs.Get(
      splats
          ? std::vector<Stage>{{GL_VERTEX_SHADER, "splat.vert"}, {GL_FRAGMENT_SHADER, "splat.frag"}}
          : std::vector<Stage>{{GL_VERTEX_SHADER, "mesh.vert"}, {GL_FRAGMENT_SHADER, "mesh.frag"}},
      {"CLIP_CONTROL " + std::to_string(static_cast<int>(clip_control))});
  const Uniforms set(program);
  const ViewPlacement& placed = frame.placements[i];
  const PinholeCamera& novel = frame.novel;
  set.Set("depth_camera", Intrinsics(view.DepthCamera()));
  set.Set("novel_from_view", placed.rotation);
  set.Set("view_centre", placed.translation);
  set.Set("near_z", placed.near_z);
  set.Set("clip_from_cam",
          Eigen::Vector4d(2 * novel.fx_px() / width, 2 * novel.fy_px() / height,
                          2 * novel.cx_px() / width - 1, 2 * novel.cy_px() / height - 1));
  set.Set("novel_camera", Intrinsics(novel));
  set.Set("novel_size", width, height);
  set.Set("sample_step", static_cast<double>(frame.options.resolution));
  set.Set("point_size", frame.options.point_size);
  set.Set("first_row", static_cast<double>(band.first));
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  if (clip_control) glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  if (splats) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, geometry.points.name());
  } else {  // SPEC 2.4: what turns the other way shows a surface's back
    glEnable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    glFrontFace(GL_CCW);
  }
  glBindVertexArray(geometry.array.name());
  DrawTriangles(geometry.index_count);
  if (clip_control) glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DEPTH_TEST);
}

}  // namespace

void DrawViewLayers(const RenderFrame& frame, const Band& band, ViewStore& store,
                    ProgramCache& programs, const Targets& targets, bool clip_control) {
  for (int i = 0; i < static_cast<int>(frame.views.size()); ++i) {
    DrawView(frame, band, i, store, programs, targets, clip_control);
  }
}

}  // namespace dtr::gl
