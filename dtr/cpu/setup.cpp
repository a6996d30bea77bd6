#include "dtr/cpu/setup.h"

#include <unordered_map>

#include "dtr/base/parallel_for.h"
#include "dtr/render/exposure.h"
#include "dtr/render/frame.h"
#include "dtr/render/texture.h"

namespace dtr::cpu {
namespace {

ViewInNovel InNovel(const View& view, const Pose& novel_from_world) {
  RequireLoaded(view);
  const ViewPlacement placed = PlaceView(view, novel_from_world);
  return {&view, placed.rotation, placed.translation, placed.near_z};
}

/// SPEC 1.4; `order`: the views' indices into the scene.
void SetCutFactors(const ViewSelection& selection, const std::vector<int>& order,
                   std::vector<ResolveView>& views) {
  const std::vector<double> factors = CutFactors(selection, selection.views.size());
  std::unordered_map<int, double> factor_of;
  for (size_t k = 0; k < factors.size(); ++k) factor_of[selection.views[k]] = factors[k];
  for (size_t i = 0; i < order.size(); ++i) views[i].cut_factor = factor_of.at(order[i]);
}

}  // namespace

Setup MakeSetup(const RenderScene& scene, const ViewSelection& selection,
                const PinholeCamera& novel, const Pose& novel_from_world,
                const RenderOptions& options) {
  Setup setup;
  setup.order = CanonicalOrder(scene, selection.views);
  for (const int index : setup.order) {
    setup.placed.push_back(InNovel(*scene.views[static_cast<size_t>(index)], novel_from_world));
  }
  setup.exposure = FrameExposure(scene, selection, novel_from_world);
  setup.views.resize(setup.order.size());
  ParallelFor(0, static_cast<int>(setup.views.size()), [&](int i) {
    const ViewInNovel& placed = setup.placed[static_cast<size_t>(i)];
    ResolveView& view = setup.views[static_cast<size_t>(i)];
    view.in_novel = &placed;
    view.view_from_novel_rotation = placed.rotation.transpose();
    view.view_from_novel_translation = -(placed.rotation.transpose() * placed.translation);
    view.delta_inverse_depth = ThresholdsOf(*placed.view, options).delta;
    view.rim_factors = RimFactors(*placed.view);
    view.fading =
        FadingOf(*placed.view, CornersMovedPx(*placed.view, novel, novel_from_world, scene.center));
    view.clipped = ClippedOf(*placed.view, setup.exposure);
  });
  SetCutFactors(selection, setup.order, setup.views);
  ResolveSettings& settings = setup.settings;
  settings.novel = novel;
  settings.blend = BlendParametersOf(options, novel.fx_px(), scene.bounds);
  settings.absolute_delta = options.absolute_delta;
  settings.per_pixel_rule = selection.per_pixel;
  settings.views = options.views;
  settings.linear_light = options.blend_in_linear_light;
  return setup;
}

}  // namespace dtr::cpu
