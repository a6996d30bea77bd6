#include "dtr/cpu/renderer.h"

#include <algorithm>
#include <string>

#include "dtr/base/parallel_for.h"
#include "dtr/cpu/layer.h"
#include "dtr/cpu/own_depth.h"
#include "dtr/cpu/resolve.h"
#include "dtr/cpu/setup.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/exposure.h"
#include "dtr/render/finish_image.h"
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

/// SPEC 5.1: the reduced mesh of each view; none by two passes.
std::vector<AdaptiveMesh> MakeMeshes(const std::vector<ViewInNovel>& views,
                                     const RenderOptions& options) {
  std::vector<AdaptiveMesh> meshes;
  if (options.method != RenderMethod::kDeferred) return meshes;
  meshes.resize(views.size());
  ParallelFor(0, static_cast<int>(views.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    std::string unfit;  // of a stored cover; the mesh is the same without it
    meshes[k] = MakeAdaptiveMesh(*views[k].view, options, unfit);
  });
  return meshes;
}

/// One layer per view: SPEC 2 and 3, or SPEC 5 from `meshes`.
std::vector<Layer> DrawLayers(const std::vector<ViewInNovel>& views,
                              const std::vector<AdaptiveMesh>& meshes, const PinholeCamera& novel,
                              const RenderOptions& options, const BlendParameters& blend,
                              const Band& band) {
  const int count = static_cast<int>(views.size());
  std::vector<Layer> layers(views.size(), Layer(Band{}));
  const auto fill = [&](const auto& make_layer) {
    ParallelFor(0, count, [&](int i) {
      const auto k = static_cast<size_t>(i);
      layers[k] = make_layer(k);
    });
  };
  if (options.method != RenderMethod::kDeferred) {
    fill([&](size_t k) { return DrawView(views[k], novel, options, band); });
    return layers;
  }
  fill([&](size_t k) { return DrawReducedMesh(views[k], meshes[k], novel, options, band); });
  std::vector<double> surfaces = NearestSurface(layers);
  KeepSupportedSurfaces(views, novel, options, blend, band, surfaces);
  fill([&](size_t k) { return FindOwnFragments(views[k], novel, options, band, surfaces); });
  return layers;
}

}  // namespace

RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                    const Pose& novel_from_world, const RenderOptions& options) {
  CheckRenderOptions(options);
  CheckNovelCamera(novel, novel_from_world);
  RenderResult result = EmptyResult(novel);
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  result.views_used = selection.views;
  if (selection.views.empty()) return result;

  Setup setup = MakeSetup(scene, selection, novel, novel_from_world, options);
  std::vector<ResolveView>& views = setup.views;

  const std::vector<AdaptiveMesh> meshes = MakeMeshes(setup.placed, options);
  const int rows_per_band = RowsPerBand(novel, views.size());
  for (int first_row = 0; first_row < novel.height_px(); first_row += rows_per_band) {
    const Band band{novel.width_px(), first_row,
                    std::min(rows_per_band, novel.height_px() - first_row)};
    const std::vector<Layer> layers =
        DrawLayers(setup.placed, meshes, novel, options, setup.settings.blend, band);
    for (size_t i = 0; i < views.size(); ++i) views[i].layer = &layers[i];
    ParallelFor(band.first_row, band.first_row + band.rows,
                [&](int y) { ResolveRow(setup.settings, views, y, result); });
  }
  if (const auto curve = CurveOf(setup.exposure)) {
    curve->Apply(result.image);
  }
  result.coverage_share = CoverageShare(result.coverage);
  if (NeedsFinishing(options)) FinishImage(scene, novel, novel_from_world, options, result);
  return result;
}

}  // namespace dtr::cpu
