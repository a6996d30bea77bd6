#include "dtr/cpu/renderer.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/cpu/layer.h"
#include "dtr/cpu/resolve.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/frame.h"
#include "dtr/render/valid_views.h"

namespace dtr::cpu {
namespace {

// Layers of all views over one band stay below this; a larger picture takes several bands.
constexpr size_t kBandBytes = size_t{256} << 20;
constexpr size_t kLayerBytesPerPixel = sizeof(double);

ViewInNovel InNovel(const View& view, const Pose& novel_from_world) {
  const ViewPlacement placed = PlaceView(view, novel_from_world);
  return {&view, placed.rotation, placed.translation, placed.near_z};
}

int RowsPerBand(const PinholeCamera& novel, size_t views) {
  const size_t bytes_per_row = views * static_cast<size_t>(novel.width_px()) * kLayerBytesPerPixel;
  const size_t rows = std::max<size_t>(1, kBandBytes / bytes_per_row);
  return static_cast<int>(std::min<size_t>(rows, static_cast<size_t>(novel.height_px())));
}

}  // namespace

RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                    const Pose& novel_from_world, const RenderOptions& options) {
  CheckRenderOptions(options);
  if (options.method != RenderMethod::kTwoPass) {
    throw UsageError("--method: expected two-pass with --renderer cpu, found deferred");
  }
  CheckNovelCamera(novel, novel_from_world);
  RenderResult result = EmptyResult(novel);
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  result.views_used = selection.views;
  if (selection.views.empty()) return result;

  const std::vector<int> order = CanonicalOrder(scene, selection.views);
  std::vector<ViewInNovel> placed;
  std::vector<ResolveView> views(order.size());
  for (const int index : order) {
    placed.push_back(InNovel(*scene.views[static_cast<size_t>(index)], novel_from_world));
  }
  for (size_t i = 0; i < placed.size(); ++i) {
    views[i].in_novel = &placed[i];
    views[i].view_from_novel_rotation = placed[i].rotation.transpose();
    views[i].view_from_novel_translation =
        -(placed[i].rotation.transpose() * placed[i].translation);
    views[i].delta_inverse_depth = ThresholdsOf(*placed[i].view, options).delta;
  }
  ResolveSettings settings;
  settings.novel = novel;
  settings.blend = BlendParametersOf(options, novel.fx_px());
  settings.absolute_delta = options.absolute_delta;
  settings.per_pixel_rule = selection.per_pixel;
  settings.views = options.views;
  settings.linear_light = options.blend_in_linear_light;

  const int rows_per_band = RowsPerBand(novel, views.size());
  const int count = static_cast<int>(views.size());
  for (int first_row = 0; first_row < novel.height_px(); first_row += rows_per_band) {
    const Band band{novel.width_px(), first_row,
                    std::min(rows_per_band, novel.height_px() - first_row)};
    std::vector<Layer> layers(views.size(), Layer(Band{}));
    ParallelFor(0, count, options.threads, [&](int i) {
      const auto k = static_cast<size_t>(i);
      layers[k] = DrawView(placed[k], novel, options, band);
    });
    for (size_t i = 0; i < views.size(); ++i) views[i].layer = &layers[i];
    ParallelFor(band.first_row, band.first_row + band.rows, options.threads,
                [&](int y) { ResolveRow(settings, views, y, result); });
  }
  result.coverage_share = CoverageShare(result.coverage);
  if (options.fill_holes) FillHolesFromViews(scene, novel, novel_from_world, options, result);
  return result;
}

}  // namespace dtr::cpu
