#include "dtr/eval/visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/types/luma.h"

namespace dtr::eval {
namespace {

constexpr double kSmoothRatio = 1.03;    // neighbouring depths of a larger ratio: other surfaces
constexpr double kOnSurface = 1e-3;      // relative; float depth and interpolation err by 1e-5
constexpr double kOnEdgeSurface = 1e-2;  // relative; the nearest centre is up to 0.7 px away
constexpr int kTextureRadius = 4;        // 9x9
constexpr double kTextureLevels = 4;     // standard deviation of at least 4 levels

void RequireDepth(const TrueView& view) {
  if (view.depth == nullptr || view.depth->width() != view.camera.width_px() ||
      view.depth->height() != view.camera.height_px() || view.depth->kind() != DepthKind::kPlaneZ) {
    throw Error(fmt::format("visibility: expected true plane-z depth of {}x{} for every view",
                            view.camera.width_px(), view.camera.height_px()));
  }
}

}  // namespace

bool Sees(const TrueView& view, const Eigen::Vector3d& p_in_world) {
  const Eigen::Vector3d p = view.cam_from_world * p_in_world;
  const auto pixel = view.camera.PixelFromCam(p);
  if (!pixel || !view.camera.Contains(*pixel)) return false;
  const DepthImage& depth = *view.depth;
  const double u = pixel->x() - 0.5, v = pixel->y() - 0.5;
  const int x0 = static_cast<int>(std::floor(u)), y0 = static_cast<int>(std::floor(v));
  if (depth.Contains(x0, y0) && depth.Contains(x0 + 1, y0 + 1)) {
    const float corner[4] = {depth(x0, y0), depth(x0 + 1, y0), depth(x0, y0 + 1),
                             depth(x0 + 1, y0 + 1)};
    const auto [low, high] = std::minmax_element(corner, corner + 4);
    if (!DepthImage::IsHole(*low) && !DepthImage::IsHole(*high) && *high < kSmoothRatio * *low) {
      const double a = u - x0, b = v - y0;
      const double inverse = (1 - b) * ((1 - a) / corner[0] + a / corner[1]) +
                             b * ((1 - a) / corner[2] + a / corner[3]);
      return p.z() * inverse <= 1 + kOnSurface;
    }
  }
  const float nearest = depth(std::min(static_cast<int>(pixel->x()), depth.width() - 1),
                              std::min(static_cast<int>(pixel->y()), depth.height() - 1));
  // Where the view hits nothing (sky), nothing hides the point.
  return DepthImage::IsHole(nearest) || p.z() <= nearest * (1 + kOnEdgeSurface);
}

Grid<std::uint8_t> CountSeenBy(const TrueView& novel, std::span<const TrueView> others) {
  RequireDepth(novel);
  for (const TrueView& other : others) RequireDepth(other);
  const Pose world_from_novel = novel.cam_from_world.Inverse();
  Grid<std::uint8_t> count(novel.camera.width_px(), novel.camera.height_px());
  ParallelFor(0, count.height(), [&](int y) {
    for (int x = 0; x < count.width(); ++x) {
      const float z = (*novel.depth)(x, y);
      if (DepthImage::IsHole(z)) continue;
      const Eigen::Vector3d p =
          world_from_novel * novel.camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      int seen = 0;
      for (const TrueView& other : others) seen += Sees(other, p);
      count(x, y) = static_cast<std::uint8_t>(std::min(seen, 255));
    }
  });
  return count;
}

double VisibleCoverage(const TrueView& novel, std::span<const TrueView> sources,
                       const Mask& coverage) {
  const Grid<std::uint8_t> count = CountSeenBy(novel, sources);
  if (coverage.width() != count.width() || coverage.height() != count.height()) {
    throw Error(fmt::format("visibility: expected coverage of {}x{}, found {}x{}", count.width(),
                            count.height(), coverage.width(), coverage.height()));
  }
  long long visible = 0, covered = 0;
  for (size_t i = 0; i < count.data().size(); ++i) {
    if (count.data()[i] == 0) continue;
    ++visible;
    covered += coverage.data()[i] != 0;
  }
  return visible == 0 ? 1.0 : static_cast<double>(covered) / static_cast<double>(visible);
}

Mask VisibleMask(const TrueView& view, std::span<const TrueView> others, int min_views) {
  Mask mask = CountSeenBy(view, others);
  for (std::uint8_t& value : mask.data()) value = value >= min_views ? 255 : 0;
  return mask;
}

Mask TexturedMask(const ImageRgb8& image) {
  if (image.empty() || image.channels() != 3) throw Error("texture mask: expected an RGB image");
  const int width = image.width(), height = image.height();
  // Integer summed-area tables of 256 * luma: exact, so the order of summing does not matter.
  const auto stride = static_cast<size_t>(width) + 1;
  std::vector<long long> sum(stride * (static_cast<size_t>(height) + 1)), squares(sum.size());
  for (int y = 0; y < height; ++y) {
    long long row_sum = 0, row_squares = 0;
    for (int x = 0; x < width; ++x) {
      const long long v = Luma(&image(x, y));
      row_sum += v;
      row_squares += v * v;
      const size_t here = (static_cast<size_t>(y) + 1) * stride + static_cast<size_t>(x) + 1;
      sum[here] = sum[here - stride] + row_sum;
      squares[here] = squares[here - stride] + row_squares;
    }
  }
  Mask mask(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto left = static_cast<size_t>(std::max(0, x - kTextureRadius)),
                 right = static_cast<size_t>(std::min(width, x + kTextureRadius + 1));
      const auto top = static_cast<size_t>(std::max(0, y - kTextureRadius)) * stride,
                 bottom = static_cast<size_t>(std::min(height, y + kTextureRadius + 1)) * stride;
      const auto box = [&](const std::vector<long long>& table) {
        return static_cast<double>(table[bottom + right] - table[bottom + left] -
                                   table[top + right] + table[top + left]);
      };
      const double n = static_cast<double>(right - left) *
                       (static_cast<double>(bottom - top) / static_cast<double>(stride));
      const double mean = box(sum) / n;
      const double variance = std::max(0.0, box(squares) / n - mean * mean) / (256.0 * 256.0);
      if (variance >= kTextureLevels * kTextureLevels) mask(x, y) = 255;
    }
  }
  return mask;
}

}  // namespace dtr::eval
