#include "dtr/cpu/renderer.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/cpu/layer.h"
#include "dtr/cpu/resolve.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/valid_views.h"

namespace dtr::cpu {
namespace {

// Layers of all views over one band stay below this; a larger picture takes several bands.
constexpr size_t kBandBytes = size_t{256} << 20;
constexpr size_t kLayerBytesPerPixel = sizeof(double);
// Far beyond any photo; refuses a slip of the pen before memory is asked for.
constexpr long long kMaxNovelPixels = 1LL << 28;
// Surfaces nearer to the novel camera than this share of the view's baseline are cut (SPEC 2.5).
constexpr double kNearPlaneShare = 1e-3;

void CheckNovel(const PinholeCamera& novel, const Pose& novel_from_world) {
  if (static_cast<long long>(novel.width_px()) * novel.height_px() > kMaxNovelPixels) {
    throw UsageError("--size: expected at most 2^28 pixels, found " +
                     std::to_string(novel.width_px()) + "x" + std::to_string(novel.height_px()));
  }
  if (!novel_from_world.translation.allFinite() ||
      !novel_from_world.rotation.coeffs().allFinite() || !(novel_from_world.rotation.norm() > 0)) {
    throw Error("novel camera: expected a finite pose, found NaN, infinity or a zero rotation");
  }
}

RenderResult EmptyResult(const PinholeCamera& novel) {
  const int width = novel.width_px(), height = novel.height_px();
  RenderResult result;
  result.image = ImageRgb8(width, height, 3);
  result.depth = DepthImage(width, height);
  result.coverage = Mask(width, height);
  result.view_count = Grid<std::uint8_t>(width, height);
  result.delta_border = Mask(width, height);
  return result;
}

/// SPEC 0.5: relative poses from the difference of the centres, so that the world's offset cancels
/// before anything is multiplied.
ViewInNovel PlaceView(const View& view, const Pose& novel_from_world) {
  ViewInNovel placed;
  placed.view = &view;
  const Eigen::Quaterniond novel_rotation = novel_from_world.rotation.normalized();
  const Eigen::Quaterniond view_rotation = view.cam_from_world.rotation.normalized();
  placed.rotation = (novel_rotation * view_rotation.conjugate()).toRotationMatrix();
  placed.translation =
      novel_rotation * (view.CenterInWorld() - novel_from_world.TargetOriginInSource());
  placed.near_z = kNearPlaneShare * DisparityBaseline(view);
  return placed;
}

int RowsPerBand(const PinholeCamera& novel, size_t views) {
  const size_t bytes_per_row = views * static_cast<size_t>(novel.width_px()) * kLayerBytesPerPixel;
  const size_t rows = std::max<size_t>(1, kBandBytes / bytes_per_row);
  return static_cast<int>(std::min<size_t>(rows, static_cast<size_t>(novel.height_px())));
}

double CoverageShare(const Mask& coverage) {
  const auto seen = std::count(coverage.data().begin(), coverage.data().end(), 255);
  return static_cast<double>(seen) / static_cast<double>(coverage.data().size());
}

}  // namespace

RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                    const Pose& novel_from_world, const RenderOptions& options) {
  CheckRenderOptions(options);
  if (options.method != RenderMethod::kTwoPass) {
    throw UsageError("--method: expected two-pass with --renderer cpu, found deferred");
  }
  CheckNovel(novel, novel_from_world);
  RenderResult result = EmptyResult(novel);
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  result.views_used = selection.views;
  if (selection.views.empty()) return result;

  // SPEC 4.7: the canonical order is that of the ids.
  std::vector<int> order = selection.views;
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const std::string &id_a = scene.views[static_cast<size_t>(a)]->id,
                      &id_b = scene.views[static_cast<size_t>(b)]->id;
    return id_a != id_b ? id_a < id_b : a < b;
  });
  std::vector<ViewInNovel> placed;
  std::vector<ResolveView> views(order.size());
  for (const int index : order) {
    placed.push_back(PlaceView(*scene.views[static_cast<size_t>(index)], novel_from_world));
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
