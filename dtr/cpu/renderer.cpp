#include "dtr/cpu/renderer.h"

#include <algorithm>
#include <limits>

#include "dtr/base/parallel_for.h"
#include "dtr/cpu/layer.h"
#include "dtr/cpu/own_depth.h"
#include "dtr/cpu/resolve.h"
#include "dtr/cpu/setup.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/frame.h"
#include "dtr/render/valid_views.h"

namespace dtr::cpu {
namespace {

// Layers of all views over one band stay below this; a larger image takes several bands.
constexpr size_t kBandBytes = size_t{256} << 20;
constexpr size_t kLayerBytesPerPixel = sizeof(double);

int RowsPerBand(const PinholeCamera& novel, size_t views) {
  const size_t bytes_per_row = views * static_cast<size_t>(novel.width_px()) * kLayerBytesPerPixel;
  const size_t rows = std::max<size_t>(1, kBandBytes / bytes_per_row);
  return static_cast<int>(std::min<size_t>(rows, static_cast<size_t>(novel.height_px())));
}

/// Moves a start depth nearer by pixels of disparity, the smallest that any of the views has.
void MoveStart(const std::vector<ViewInNovel>& views, const RenderOptions& options, double shift_px,
               std::vector<double>& start) {
  double pixel = std::numeric_limits<double>::infinity();
  for (const ViewInNovel& view : views) {
    pixel = std::min(pixel, ThresholdsOf(*view.view, options).pixel);
  }
  for (double& w : start) {
    if (w > 0) w = std::max(w + shift_px * pixel, 0.0);
  }
}

/// One layer per view: SPEC 2 and 3, or SPEC 5.
std::vector<Layer> DrawLayers(const std::vector<ViewInNovel>& views, const PinholeCamera& novel,
                              const RenderOptions& options, const Band& band,
                              double start_shift_px) {
  const bool deferred = options.method == RenderMethod::kDeferred;
  RenderOptions drawn = options;
  if (deferred) drawn.primitive = Primitive::kMesh;  // SPEC 5.1
  const int count = static_cast<int>(views.size());
  std::vector<Layer> layers(views.size(), Layer(Band{}));
  const auto fill = [&](const auto& make_layer) {
    ParallelFor(0, count, options.threads, [&](int i) {
      const auto k = static_cast<size_t>(i);
      layers[k] = make_layer(views[k]);
    });
  };
  fill([&](const ViewInNovel& view) { return DrawView(view, novel, drawn, band); });
  if (!deferred) return layers;
  std::vector<double> surfaces = NearestSurface(layers);
  if (start_shift_px != 0) MoveStart(views, options, start_shift_px, surfaces);
  KeepSurfacesThatViewsHold(views, novel, options, band, surfaces);
  fill([&](const ViewInNovel& view) {
    return FindOwnFragments(view, novel, options, band, surfaces);
  });
  return layers;
}

RenderResult Draw(const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options,
                  double start_shift_px) {
  CheckRenderOptions(options);
  CheckNovelCamera(novel, novel_from_world);
  RenderResult result = EmptyResult(novel);
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  result.views_used = selection.views;
  if (selection.views.empty()) return result;

  Setup setup = MakeSetup(scene, selection, novel, novel_from_world, options);
  std::vector<ResolveView>& views = setup.views;

  const int rows_per_band = RowsPerBand(novel, views.size());
  for (int first_row = 0; first_row < novel.height_px(); first_row += rows_per_band) {
    const Band band{novel.width_px(), first_row,
                    std::min(rows_per_band, novel.height_px() - first_row)};
    const std::vector<Layer> layers =
        DrawLayers(setup.placed, novel, options, band, start_shift_px);
    for (size_t i = 0; i < views.size(); ++i) views[i].layer = &layers[i];
    ParallelFor(band.first_row, band.first_row + band.rows, options.threads,
                [&](int y) { ResolveRow(setup.settings, views, y, result); });
  }
  result.coverage_share = CoverageShare(result.coverage);
  if (options.fill_holes) FillHolesFromViews(scene, novel, novel_from_world, options, result);
  return result;
}

}  // namespace

RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                    const Pose& novel_from_world, const RenderOptions& options) {
  return Draw(scene, novel, novel_from_world, options, 0);
}

RenderResult RenderFromMovedStart(const RenderScene& scene, const PinholeCamera& novel,
                                  const Pose& novel_from_world, const RenderOptions& options,
                                  double start_shift_px) {
  return Draw(scene, novel, novel_from_world, options, start_shift_px);
}

}  // namespace dtr::cpu
