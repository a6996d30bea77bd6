#include "dtr/render/frame.h"

#include <algorithm>
#include <limits>
#include <string>
#include <tuple>
#include <unordered_map>

#include "dtr/base/error.h"
#include "dtr/render/exposure.h"

namespace dtr {
namespace {

// Far beyond any photo; rejects a slip of the pen before memory is asked for.
constexpr long long kMaxNovelPixels = 1LL << 28;
// Surfaces nearer to the novel camera than this share of the view's baseline are cut (SPEC 2.5).
constexpr double kNearPlaneShare = 1e-3;

}  // namespace

void CheckNovelCamera(const PinholeCamera& novel, const Pose& novel_from_world) {
  if (static_cast<long long>(novel.width_px()) * novel.height_px() > kMaxNovelPixels) {
    throw UsageError("image: expected at most 2^28 pixels, found " +
                     std::to_string(novel.width_px()) + "x" + std::to_string(novel.height_px()) +
                     "; give a smaller `size`");
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

double CoverageShare(const Mask& coverage) {
  const auto seen = std::count(coverage.data().begin(), coverage.data().end(), 255);
  return static_cast<double>(seen) / static_cast<double>(coverage.data().size());
}

ViewPlacement PlaceView(const View& view, const Pose& novel_from_world) {
  const Eigen::Quaterniond novel_rotation = novel_from_world.rotation.normalized();
  const Eigen::Quaterniond view_rotation = view.cam_from_world.rotation.normalized();
  ViewPlacement placed;
  placed.rotation = (novel_rotation * view_rotation.conjugate()).toRotationMatrix();
  placed.translation =
      novel_rotation * (view.CenterInWorld() - novel_from_world.TargetOriginInSource());
  placed.near_z = kNearPlaneShare * DisparityBaseline(view);
  return placed;
}

double CornersMovedPx(const View& view, const PinholeCamera& novel, const Pose& novel_from_world,
                      const Eigen::Vector3d& scene_center) {
  const ViewPlacement placed = PlaceView(view, novel_from_world);
  const double depth = (scene_center - novel_from_world.TargetOriginInSource()).norm();
  double moved_px = 0;
  for (const int corner : {0, 1, 2, 3}) {
    const auto corner_of = [&](const PinholeCamera& camera) {
      return Eigen::Vector2d(corner % 2 * camera.width_px(), corner / 2 * camera.height_px());
    };
    const Eigen::Vector3d p_in_novel = depth * novel.RayFromPixel(corner_of(novel));
    const auto seen_at =
        view.camera.PixelFromCam(placed.rotation.transpose() * (p_in_novel - placed.translation));
    if (!seen_at) return std::numeric_limits<double>::infinity();
    moved_px = std::max(moved_px, (*seen_at - corner_of(view.camera)).norm());
  }
  return moved_px;
}

std::vector<int> CanonicalOrder(const RenderScene& scene, std::vector<int> views) {
  std::sort(views.begin(), views.end(), [&](int a, int b) {
    const std::string &id_a = scene.views[static_cast<size_t>(a)]->id,
                      &id_b = scene.views[static_cast<size_t>(b)]->id;
    return std::tie(id_a, a) < std::tie(id_b, b);
  });
  return views;
}

RenderFrame MakeFrame(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options,
                      const ViewSelection& selection) {
  RenderFrame frame{scene, novel, options, selection.per_pixel,
                    {},    {},    {},      FrameExposure(scene, selection, novel_from_world)};
  for (const int index : CanonicalOrder(scene, selection.views)) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    frame.views.push_back(&view);
    frame.placements.push_back(PlaceView(view, novel_from_world));
    frame.placements.back().fading =
        FadingOf(view, CornersMovedPx(view, novel, novel_from_world, scene.center));
    frame.placements.back().clipped = ClippedOf(view, frame.exposure);
    frame.cut_factors.push_back(1);
  }
  return frame;
}

void SetCutFactors(const ViewSelection& selection, size_t count, RenderFrame& frame) {
  const std::vector<double> factors = CutFactors(selection, count);
  const std::vector<const View*> nearest_first = NearestFirst(frame.scene, selection);
  std::unordered_map<const View*, double> factor_of;
  for (size_t k = 0; k < count; ++k) factor_of.emplace(nearest_first[k], factors[k]);
  for (size_t i = 0; i < frame.views.size(); ++i) {
    frame.cut_factors[i] = factor_of.at(frame.views[i]);
  }
}

std::vector<const View*> NearestFirst(const RenderScene& scene, const ViewSelection& selection) {
  std::vector<const View*> views;
  for (const int index : selection.views) views.push_back(scene.views[static_cast<size_t>(index)]);
  return views;
}

void StoreRows(const Band& band, int width_px, const std::uint8_t* image, const std::uint8_t* marks,
               RenderResult& result) {
  const size_t pixels = static_cast<size_t>(width_px) * static_cast<size_t>(band.count);
  const size_t first = static_cast<size_t>(band.first) * static_cast<size_t>(width_px);
  for (size_t p = 0; p < pixels; ++p) {
    for (size_t c = 0; c < 3; ++c) result.image.data()[3 * (first + p) + c] = image[4 * p + c];
    result.coverage.data()[first + p] = image[4 * p + 3];
    result.view_count.data()[first + p] = marks[4 * p];
    result.delta_border.data()[first + p] = marks[4 * p + 1];
  }
}

}  // namespace dtr
