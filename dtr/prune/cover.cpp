#include "dtr/prune/cover.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/render/geometry.h"
#include "dtr/render/scene.h"
#include "dtr/render/texture.h"

namespace dtr::prune {
namespace {

constexpr int kPlacesAlongTile = 8;
constexpr double kMaxPlaces = 65536;  // of a view: what memory and time are for
constexpr double kWithinPx = 1;       // of disparity; SPEC 5.2 holds a surface as far
// Pixels of a coverer on the area of one of the view's: 1.5 times as coarse per axis shows as blur
// of less than what resampling costs.
constexpr double kMinDensity = 1 / (1.5 * 1.5);

bool IsUsable(const View& view, int depth_x, int depth_y) {
  const int s = view.depth_scale;
  return view.mask.empty() || view.mask(depth_x * s + s / 2, depth_y * s + s / 2) != 0;
}

double MedianDepth(const View& view) {
  std::vector<float> depths;
  for (const float z : view.depth.grid().data()) {
    if (!DepthImage::IsHole(z)) depths.push_back(z);
  }
  if (depths.empty()) return 0;
  return UpperMedian(depths);
}

/// The views nearest by angle at what the view looks at; ties to the smaller index.
std::vector<int> CoverNeighboursOf(int index, const std::vector<const View*>& views) {
  const View& view = *views[static_cast<size_t>(index)];
  const double depth = MedianDepth(view);
  const Eigen::Vector3d centre = view.CenterInWorld();
  const Eigen::Vector3d target =
      centre + depth * (view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  std::vector<std::pair<double, int>> angles;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    if (i == index) continue;
    const Eigen::Vector3d other = views[static_cast<size_t>(i)]->CenterInWorld();
    angles.emplace_back(AngleBetween(centre - target, other - target), i);
  }
  std::sort(angles.begin(), angles.end());
  angles.resize(std::min<size_t>(angles.size(), kMaxCoverers));
  std::vector<int> neighbours;
  for (const auto& [angle, i] : angles) neighbours.push_back(i);
  return neighbours;
}

/// One view's places, looked up in its neighbours.
class PlaceFinder {
 public:
  PlaceFinder(const std::vector<const View*>& views, const std::vector<TileGrid>& grids, int index)
      : views_(views),
        grids_(grids),
        view_(*views[static_cast<size_t>(index)]),
        camera_(view_.DepthCamera()),
        depth_break_(ThresholdsOf(view_, {}).depth_break),
        neighbours_(CoverNeighboursOf(index, views)) {
    for (const int n : neighbours_) {
      const View& other = *views[static_cast<size_t>(n)];
      other_from_view_.push_back(other.cam_from_world * view_.cam_from_world.Inverse());
      other_cameras_.push_back(other.DepthCamera());
      pixels_.push_back(ThresholdsOf(other, {}).pixel);
    }
  }

  CoveredView Find(const TileGrid& grid) const {
    CoveredView covered{view_.id, grid, std::vector<int>(static_cast<size_t>(grid.count())), {}};
    const int step = grid.step_px;
    for (int y = step / 2; y < view_.depth.height(); y += step) {
      for (int x = step / 2; x < view_.depth.width(); x += step) {
        if (!IsUsable(view_, x, y)) continue;
        const int tile = y / grid.size_px() * grid.columns + x / grid.size_px();
        ++covered.looked[static_cast<size_t>(tile)];
        if (DepthImage::IsHole(view_.depth(x, y))) continue;
        covered.places.push_back(PlaceAt(x, y, tile));
      }
    }
    return covered;
  }

 private:
  Eigen::Vector3d PointAt(int x, int y, double depth) const {
    return camera_.CamFromPixel({x + 0.5, y + 0.5}, depth, DepthKind::kPlaneZ);
  }

  /// A step to the side on the surface, in the view's frame: where there is no depth, or one of
  /// another surface, the surface is taken to face the view.
  Eigen::Vector3d Beside(int x, int y, int dx, int dy) const {
    const double z = view_.depth(x, y);
    double beside = z;
    if (view_.depth.grid().Contains(x + dx, y + dy)) {
      const float other = view_.depth(x + dx, y + dy);
      const bool same = std::abs(1 / other - 1 / z) <= 2 * depth_break_;
      if (!DepthImage::IsHole(other) && same) beside = other;
    }
    return PointAt(x + dx, y + dy, beside);
  }

  CoveredPlace PlaceAt(int x, int y, int tile) const {
    CoveredPlace place;
    place.tile = tile;
    const Eigen::Vector3d point = PointAt(x, y, view_.depth(x, y));
    const Eigen::Vector3d right = Beside(x, y, 1, 0), below = Beside(x, y, 0, 1);
    const double s = view_.depth_scale;
    const auto colour = ColourAt(view_, {s * (x + 0.5), s * (y + 0.5)}, false);
    if (!colour) return place;
    for (size_t k = 0; k < neighbours_.size(); ++k) {
      const auto found = Look(k, point, right, below, *colour);
      if (found) place.coverers[place.count++] = *found;
    }
    return place;
  }

  std::optional<Coverer> Look(size_t k, const Eigen::Vector3d& point, const Eigen::Vector3d& right,
                              const Eigen::Vector3d& below, const Eigen::Vector3d& colour) const {
    const auto n = static_cast<size_t>(neighbours_[k]);
    const View& other = *views_[n];
    const PinholeCamera& camera = other_cameras_[k];
    const Eigen::Vector3d in_other = other_from_view_[k] * point;
    const auto pixel = camera.PixelFromCam(in_other);
    if (!pixel || !camera.Contains(*pixel)) return std::nullopt;
    const int x = static_cast<int>(pixel->x()), y = static_cast<int>(pixel->y());
    const float own = other.depth(x, y);
    if (DepthImage::IsHole(own) || !IsUsable(other, x, y)) return std::nullopt;
    if (std::abs(1.0 / own - 1 / in_other.z()) > kWithinPx * pixels_[k]) return std::nullopt;
    const auto u = camera.PixelFromCam(other_from_view_[k] * right);
    const auto v = camera.PixelFromCam(other_from_view_[k] * below);
    if (!u || !v) return std::nullopt;
    const Eigen::Vector2d du = *u - *pixel, dv = *v - *pixel;
    // Negative: the other sees the surface's back.
    const double per_pixel = other.depth_scale / static_cast<double>(view_.depth_scale);
    if (du.x() * dv.y() - du.y() * dv.x() < kMinDensity / (per_pixel * per_pixel)) {
      return std::nullopt;
    }
    const auto seen = ColourAt(other, other.depth_scale * *pixel, false);
    if (!seen) return std::nullopt;
    const TileGrid& grid = grids_[n];
    return Coverer{static_cast<std::int32_t>(n),
                   y / grid.size_px() * grid.columns + x / grid.size_px(),
                   static_cast<float>((255 * (*seen - colour)).squaredNorm() / 3)};
  }

  const std::vector<const View*>& views_;
  const std::vector<TileGrid>& grids_;
  const View& view_;
  const PinholeCamera camera_;
  const double depth_break_;  // a difference of 1/z
  const std::vector<int> neighbours_;
  std::vector<Pose> other_from_view_;
  std::vector<PinholeCamera> other_cameras_;
  std::vector<double> pixels_;  // of disparity, differences of 1/z
};

}  // namespace

TileGrid TileGridOf(const View& view) {
  TileGrid grid;
  const double width = view.depth.width(), height = view.depth.height();
  while (width * height > kMaxPlaces * grid.step_px * grid.step_px) grid.step_px += 4;
  grid.columns = (view.depth.width() + grid.size_px() - 1) / grid.size_px();
  grid.rows = (view.depth.height() + grid.size_px() - 1) / grid.size_px();
  static_assert(kPlacesAlongTile == 8);
  return grid;
}

CoverMap WhoCovers(const DtrSet& set, const std::vector<std::string>& without) {
  const RenderScene scene = MakeRenderScene(set, without);
  std::vector<TileGrid> grids;
  for (const View* view : scene.views) grids.push_back(TileGridOf(*view));
  CoverMap map;
  map.views.resize(scene.views.size());
  ParallelFor(0, static_cast<int>(scene.views.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    map.views[k] = PlaceFinder(scene.views, grids, i).Find(grids[k]);
  });
  return map;
}

}  // namespace dtr::prune
