#include "dtr/advise/look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "dtr/advise/places.h"
#include "dtr/base/order_statistics.h"
#include "dtr/render/geometry.h"

namespace dtr::advise {
namespace {

constexpr double kOverlap = 1.2;  // of footprints, so that tilted surfaces stay closed
constexpr int kLargestFootprintPx = 32;
constexpr double kFarDepths[] = {1, 4, 100};  // of the median seen
constexpr double kPercentile = 0.95;

struct Buffer {
  DepthImage depth;
  Grid<int> owner;  // view that the depth is of
};

void Draw(const CoarseView& view, int index, const Place& place, Buffer& buffer) {
  const Pose place_from_view = place.cam_from_world * view.cam_from_world.Inverse();
  const double scale = kOverlap * place.camera.fx_px() / view.camera.fx_px();
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      const float z = view.depth(x, y);
      if (DepthImage::IsHole(z)) continue;
      const Eigen::Vector3d p =
          place_from_view * view.camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      const auto pixel = place.camera.PixelFromCam(p);
      if (!pixel || !place.camera.Contains(*pixel)) continue;
      const double half = std::min(scale * z / p.z(), static_cast<double>(kLargestFootprintPx)) / 2;
      const int left = std::max(0, static_cast<int>(std::ceil(pixel->x() - half - 0.5)));
      const int right =
          std::min(buffer.depth.width() - 1, static_cast<int>(std::floor(pixel->x() + half - 0.5)));
      const int top = std::max(0, static_cast<int>(std::ceil(pixel->y() - half - 0.5)));
      const int bottom = std::min(buffer.depth.height() - 1,
                                  static_cast<int>(std::floor(pixel->y() + half - 0.5)));
      for (int j = top; j <= bottom; ++j) {
        for (int i = left; i <= right; ++i) {
          float& front = buffer.depth(i, j);
          if (!DepthImage::IsHole(front) && front <= p.z()) continue;
          front = static_cast<float>(p.z());
          buffer.owner(i, j) = index;
        }
      }
    }
  }
}

double MedianOf(const DepthImage& depth) {
  std::vector<float> seen;
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (!DepthImage::IsHole(depth(x, y))) seen.push_back(depth(x, y));
    }
  }
  if (seen.empty()) return 0;
  return UpperMedian(seen);
}

// A photo that shows the point.
void Count(const Eigen::Vector3d& point, const Eigen::Vector3d& place, const Eigen::Vector3d& photo,
           Glance& glance) {
  const auto angle = static_cast<float>(AngleBetween(place - point, photo - point));
  if (glance.photos == 0 || angle < glance.angle_rad) glance.angle_rad = angle;
  ++glance.photos;
  glance.what = Glance::What::kSeen;
}

}  // namespace

Look LookFrom(const Place& place, std::span<const CoarseView> views) {
  const std::vector<size_t> near = NearestViews(views, place.cam_from_world, kViewsAsked);
  const int width = place.camera.width_px(), height = place.camera.height_px();
  Buffer buffer{DepthImage(width, height, DepthKind::kPlaneZ), Grid<int>(width, height, 1, -1)};
  for (const size_t index : near) Draw(views[index], static_cast<int>(index), place, buffer);

  const Pose world_from_place = place.cam_from_world.Inverse();
  const Eigen::Vector3d center = place.cam_from_world.TargetOriginInSource();
  const double usual = MedianOf(buffer.depth);
  Look look;
  look.glances.reserve(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto at = [&](double z) -> Eigen::Vector3d {
        return world_from_place *
               place.camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      };
      Glance& glance = look.glances.emplace_back();
      const float z = buffer.depth(x, y);
      if (DepthImage::IsHole(z)) {
        glance.point = at(std::max(usual, 1e-30)).cast<float>();
        for (const double times : kFarDepths) {
          const bool looked_at = usual > 0 && std::any_of(near.begin(), near.end(), [&](size_t i) {
                                   return VisibilityOf(views[i], at(usual * times), kOneSurface) ==
                                          Visibility::kNothing;
                                 });
          if (looked_at) glance.what = Glance::What::kDepthless;
        }
        continue;
      }
      const Eigen::Vector3d point = at(z);
      glance.point = point.cast<float>();
      const auto owner = static_cast<size_t>(buffer.owner(x, y));
      Count(point, center, views[owner].CenterInWorld(), glance);
      for (const size_t i : near) {
        if (i == owner || VisibilityOf(views[i], point, kOneSurface) != Visibility::kSeen) continue;
        Count(point, center, views[i].CenterInWorld(), glance);
      }
    }
  }
  look.view = {place.where, place.camera, place.cam_from_world, std::move(buffer.depth), 1};
  return look;
}

void AddPhoto(const CoarseView& other, Look& look) {
  const Eigen::Vector3d here = look.view.CenterInWorld(), there = other.CenterInWorld();
  for (Glance& glance : look.glances) {
    if (glance.what == Glance::What::kDepthless) continue;
    const Eigen::Vector3d point = glance.point.cast<double>();
    const Visibility visibility = VisibilityOf(other, point, kOneSurface);
    const bool shown = glance.what == Glance::What::kSeen ? visibility == Visibility::kSeen
                                                          : visibility == Visibility::kNothing;
    if (shown) Count(point, here, there, glance);
  }
}

void Measure(const Look& look, const AdviseOptions& options, Place& place) {
  size_t seen = 0, depthless = 0, single = 0;
  std::vector<float> angles;
  for (const Glance& glance : look.glances) {
    depthless += glance.what == Glance::What::kDepthless;
    if (glance.what != Glance::What::kSeen) continue;
    ++seen;
    single += glance.photos == 1;
    angles.push_back(glance.angle_rad);
  }
  const auto all = static_cast<double>(look.glances.size());
  place.seen_share = static_cast<double>(seen) / all;
  place.depthless_share = static_cast<double>(depthless) / all;
  place.unseen_share = (all - static_cast<double>(seen + depthless)) / all;
  place.single_share = seen > 0 ? static_cast<double>(single) / static_cast<double>(seen) : 0;
  place.gap_deg = 0;
  if (!angles.empty()) {
    place.gap_deg = QuantileOf(angles, kPercentile) * 180 / std::numbers::pi;
  }
  place.poor = place.unseen_share > options.max_unseen || place.gap_deg > options.max_gap_deg;
}

}  // namespace dtr::advise
