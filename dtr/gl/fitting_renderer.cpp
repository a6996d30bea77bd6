#include "dtr/gl/fitting_renderer.h"

#include <algorithm>
#include <utility>

#include "dtr/gl/drawing.h"
#include "dtr/gl/driver.h"
#include "dtr/render/valid_views.h"

namespace dtr::gl {
namespace {

bool PrefersSimd(Drawer drawer) {
  return drawer == Drawer::kFitting ? DrawsOnProcessor() : drawer == Drawer::kSimd;
}

DrawnFrame InMemory(simd::DrawnImage drawn) {
  DrawnFrame picture;
  picture.rgba = drawn.rgba, picture.depth_z = drawn.depth_z, picture.window_z = drawn.window_z;
  picture.mapping = drawn.mapping;
  picture.number = NextFrameNumber();
  picture.width_px = drawn.width_px, picture.height_px = drawn.height_px;
  picture.views_used = std::move(drawn.views_used);
  picture.views_held = drawn.views_held;
  return picture;
}

}  // namespace

FittingRenderer::FittingRenderer(const RendererSettings& settings, Drawer drawer)
    : open_gl_(settings),
      simd_({settings.gpu_bytes, settings.warn}),
      prefers_simd_(PrefersSimd(drawer)) {}

RenderResult FittingRenderer::Render(const RenderScene& scene, const PinholeCamera& novel,
                                     const Pose& novel_from_world, const RenderOptions& options) {
  return BySimd(options) ? simd_.Render(scene, novel, novel_from_world, options)
                         : open_gl_.Render(scene, novel, novel_from_world, options);
}

DrawnFrame FittingRenderer::Draw(const RenderScene& scene, const PinholeCamera& novel,
                                 const Pose& novel_from_world, const RenderOptions& options,
                                 const std::optional<simd::WindowDepthMapping>& mapping) {
  drawn_by_simd_ = BySimd(options);
  return drawn_by_simd_ ? InMemory(simd_.Draw(scene, novel, novel_from_world, options, mapping))
                        : open_gl_.Draw(scene, novel, novel_from_world, options);
}

RenderResult FittingRenderer::ReadBack() {
  return drawn_by_simd_ ? simd_.ReadBack() : open_gl_.ReadBack();
}

void FittingRenderer::Forget() {
  open_gl_.Forget();
  simd_.Forget();
}

bool FittingRenderer::CanDraw(const RenderScene& scene, const PinholeCamera& novel,
                              const Pose& novel_from_world, const RenderOptions& options) const {
  if (BySimd(options)) return simd_.CanDraw(scene, novel, novel_from_world, options);
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  return std::none_of(selection.views.begin(), selection.views.end(), [&](int index) {
    return scene.views[static_cast<size_t>(index)]->image.empty();
  });
}

}  // namespace dtr::gl
