#include "pipeline/export/detail/mesh_blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dtr::pipeline {
namespace {

constexpr int kSide = kBlockSide + 1;  // with the neighbours' first voxels
// What a distance may change by along an edge, voxels: 1 on a plane, more by noise.
constexpr double kLargestStep = 2;
// Noise that all distances have besides sigma, voxels.
constexpr double kFloor = 0.25;
constexpr double kMeshLeastCosine = 0.1;
constexpr double kRounding = 1e-6;  // of pixels, and a share of a depth: more than floats lose
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// Change of 1/z across a sample, per unit of the image plane; NaN where the neighbours are of no
// one surface with it.
Eigen::Vector2d SlopesAt(const SurfaceView& surface, int x, int y) {
  const Grid<float>& map = surface.inverse_depth;
  const float w = map(x, y);
  const auto slope = [&](int dx, int dy) {
    double sum = 0;
    int sides = 0;
    for (const int sign : {-1, 1}) {
      const int u = x + sign * dx, v = y + sign * dy;
      if (!map.Contains(u, v) || !(map(u, v) > 0)) continue;
      if (std::abs(map(u, v) - w) > surface.inverse_depth_per_px) continue;
      sum += sign * (map(u, v) - w);
      ++sides;
    }
    return sides > 0 ? sum / sides : std::numeric_limits<double>::quiet_NaN();
  };
  return {slope(1, 0) * surface.camera.fx_px(), slope(0, 1) * surface.camera.fy_px()};
}

// Cosine between the ray and the normal where the ray of a pixel meets the surface; 0 where the
// neighbours are of no one surface with it.
double CosineAt(const SurfaceView& surface, int x, int y, const Eigen::Vector3d& ray) {
  const Eigen::Vector2d slopes = SlopesAt(surface, x, y);
  const double across = slopes.x(), down = slopes.y();
  const float w = surface.inverse_depth(x, y);
  const Eigen::Vector3d n(across, down, w - across * ray.x() - down * ray.y());
  const double cosine = n.dot(ray) / (n.norm() * ray.norm());
  return cosine > 0 ? cosine : 0;  // NaN too
}

struct Voxel {
  double sum = 0, weights = 0;
  int near = 0, through = 0;
};

// Adds what a view says of a point.
void Observe(const SurfaceView& surface, const Eigen::Vector3d& p_in_world, double voxel,
             Voxel& into) {
  const Eigen::Vector3d p = surface.InCam(p_in_world);
  const auto pixel = surface.camera.PixelFromCam(p);
  if (!pixel || !surface.camera.Contains(*pixel)) return;
  const auto w = surface.InverseDepthAt(*pixel);
  const int x = static_cast<int>(pixel->x()), y = static_cast<int>(pixel->y());
  if (!w || !(surface.inverse_depth(x, y) > 0)) return;
  const Eigen::Vector3d ray = p / p.z();
  const double cosine = CosineAt(surface, x, y, ray);
  const double along = (1 / *w - p.z()) * ray.norm();
  if (cosine < kMeshLeastCosine) return;
  const double distance = along * cosine / voxel;
  if (distance < -kTruncation) return;
  if (distance > kTruncation) {
    ++into.through;
    return;
  }
  const double sigma = surface.SigmaAt(*pixel) / (*w * *w) * ray.norm() * cosine / voxel;
  // What lies behind the surface is seen by no view: other surfaces may begin there.
  const double behind = distance < 0 ? 1 + distance / kTruncation : 1;
  const double weight = behind * behind * cosine / (sigma * sigma + kFloor * kFloor) + 1e-9;
  into.sum += weight * distance;
  into.weights += weight;
  ++into.near;
}

class Lattice {
 public:
  Lattice(const BlockPlace& place, double voxel, int min_views, const SurfaceList& views)
      : voxel_(voxel) {
    for (int c = 0; c < 3; ++c) origin_[c] = double(place[static_cast<size_t>(c)]) * kBlockSide;
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          Voxel seen;
          const Eigen::Vector3d p = voxel * (origin_ + Eigen::Vector3d(x, y, z));
          for (const auto& view : views) Observe(*view, p, voxel, seen);
          const bool known = seen.near >= min_views && seen.through <= seen.near;
          distance_[Index(x, y, z)] =
              known ? static_cast<float>(seen.sum / seen.weights) : kUnknown;
        }
      }
    }
  }

  static size_t Index(int x, int y, int z) {
    return static_cast<size_t>(x + kSide * (y + kSide * z));
  }
  float At(const Eigen::Vector3i& v) const { return distance_[Index(v.x(), v.y(), v.z())]; }
  static Eigen::Vector3i Corner(int i) { return {i & 1, i >> 1 & 1, i >> 2 & 1}; }

  // Whether a cell may have a surface and has one; then its vertex.
  bool VertexOf(const Eigen::Vector3i& cell, MeshBlock::Vertex& vertex) const {
    std::array<float, 8> d{};
    int inside = 0;
    for (int i = 0; i < 8; ++i) {
      d[static_cast<size_t>(i)] = At(cell + Corner(i));
      if (std::isnan(d[static_cast<size_t>(i)])) return false;
      inside += d[static_cast<size_t>(i)] < 0;
    }
    if (inside == 0 || inside == 8) return false;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), gradient = Eigen::Vector3d::Zero();
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 8; ++i) {
        const int other = i | 1 << axis;
        if (other == i) continue;
        const double a = d[static_cast<size_t>(i)], b = d[static_cast<size_t>(other)];
        if (std::abs(a - b) > kLargestStep) return false;
        gradient[axis] += b - a;
        if ((a < 0) == (b < 0)) continue;
        Eigen::Vector3d at = Corner(i).cast<double>();
        at[axis] += a / (a - b);
        sum += at;
        ++crossings;
      }
    }
    const double length = gradient.norm();
    if (!(length > 0)) return false;
    vertex.position = (voxel_ * (origin_ + cell.cast<double>() + sum / crossings)).cast<float>();
    vertex.normal = (gradient / length).cast<float>();
    return true;
  }

 private:
  double voxel_;
  Eigen::Vector3d origin_;
  std::array<float, static_cast<size_t>(kSide* kSide* kSide)> distance_{};
};

// Furthest that a point may lie before or behind the surface of a pixel along z, voxels, to be
// within the truncation along the normal; 0: it never is. With n as in CosineAt, n . ray = w: the
// distance along the normal is |n| / w of that along z.
double ReachAt(const SurfaceView& surface, int x, int y) {
  const PinholeCamera& camera = surface.camera;
  const Eigen::Vector2d slopes = SlopesAt(surface, x, y);
  if (!slopes.allFinite()) return 0;
  const double w = surface.inverse_depth(x, y);
  // Of all rays through the pixel.
  const Eigen::Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
  const Eigen::Vector2d half(0.5 / camera.fx_px(), 0.5 / camera.fy_px());
  const double shortest = std::max(1.0, ray.norm() - half.norm());
  const double normal_z = std::abs(w - slopes.dot(ray.head<2>()));
  const double change = slopes.cwiseAbs().dot(half);
  const double least = std::hypot(slopes.norm(), std::max(0.0, normal_z - change));
  const double most = std::hypot(slopes.norm(), normal_z + change);
  if (w < kMeshLeastCosine * (1 - kRounding) * least * shortest) return 0;
  return kTruncation * std::min(most / w, 1 / (kMeshLeastCosine * shortest));
}

// Smallest and largest 1/z that InverseDepthAt gives within a pixel.
std::pair<double, double> InverseDepthsAround(const SurfaceView& surface, int x, int y) {
  const Grid<float>& map = surface.inverse_depth;
  double low = map(x, y), high = low;
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      if (!map.Contains(u, v) || !(map(u, v) > 0)) continue;
      if (std::abs(map(u, v) - map(x, y)) > kOneSurfacePx * surface.inverse_depth_per_px) continue;
      low = std::min<double>(low, map(u, v));
      high = std::max<double>(high, map(u, v));
    }
  }
  return {low, high};
}

}  // namespace

std::vector<BlockPlace> BlocksOf(const SurfaceView& surface, double voxel) {
  const Grid<float>& map = surface.inverse_depth;
  std::vector<BlockPlace> blocks;
  const double reach = kTruncation * voxel;
  const auto add = [&](const Eigen::Vector3d& p) {
    BlockPlace place{};
    for (size_t c = 0; c < 3; ++c) {
      const double block = std::floor(p[static_cast<int>(c)] / (kBlockSide * voxel));
      if (!(std::abs(block) < 1e9)) return;
      place[c] = static_cast<std::int32_t>(block);
    }
    if (blocks.empty() || blocks.back() != place) blocks.push_back(place);
  };
  const auto compact = [&] {
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  };
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      const double w = map(x, y);
      if (!(w > 0)) continue;
      const Eigen::Vector3d p = surface.PointAt({x + 0.5, y + 0.5}, w);
      for (int i = 0; i < 8; ++i)
        add(p + reach * (2 * Lattice::Corner(i).cast<double>().array() - 1).matrix());
      // Where pixels are wider than blocks, those between two of one surface as well.
      for (const auto& [u, v] : {std::pair{x + 1, y}, std::pair{x, y + 1}}) {
        if (!map.Contains(u, v) || !(map(u, v) > 0)) continue;
        if (std::abs(map(u, v) - w) > surface.inverse_depth_per_px) continue;
        const Eigen::Vector3d step = surface.PointAt({u + 0.5, v + 0.5}, map(u, v)) - p;
        const int parts = static_cast<int>(std::min(64.0, step.norm() / (kBlockSide * voxel)));
        for (int i = 1; i <= parts; ++i) add(p + step * i / (parts + 1));
      }
    }
    if (y % 16 == 15) compact();
  }
  compact();
  return blocks;
}

NearDepths::NearDepths(const SurfaceView& surface, double voxel)
    : surface_(surface), voxel_(voxel) {
  const Grid<float>& map = surface.inverse_depth;
  from_ = Grid<float>(map.width(), map.height(), 1, std::numeric_limits<float>::infinity());
  to_ = Grid<float>(map.width(), map.height());
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (!(map(x, y) > 0)) continue;
      const double reach = ReachAt(surface, x, y) * voxel;
      if (!(reach > 0)) continue;
      const auto [low, high] = InverseDepthsAround(surface, x, y);
      // What floats round is less.
      const double more = reach + kRounding / low;
      from_(x, y) = static_cast<float>(1 / high - more);
      to_(x, y) = static_cast<float>(1 / low + more);
    }
  }
}

bool NearDepths::MayReach(const BlockPlace& place) const {
  constexpr int kMaxPixels = 1 << 14;  // to look at; more take longer than the block itself
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  for (int i = 0; i < 8; ++i) {
    Eigen::Vector3d corner = Lattice::Corner(i).cast<double>();
    for (int c = 0; c < 3; ++c) {
      corner[c] = voxel_ * kBlockSide * (place[static_cast<size_t>(c)] + corner[c]);
    }
    const Eigen::Vector3d p = surface_.InCam(corner);
    if (!(p.z() > 0)) return true;
    const Eigen::Vector2d pixel = *surface_.camera.PixelFromCam(p);
    low = low.cwiseMin(Eigen::Vector3d(pixel.x(), pixel.y(), p.z()));
    high = high.cwiseMax(Eigen::Vector3d(pixel.x(), pixel.y(), p.z()));
  }
  // The image of a block is the convex hull of its corners'.
  const auto pixel = [](double at, int size) {
    return static_cast<int>(std::clamp(std::floor(at), 0.0, size - 1.0));
  };
  const int x0 = pixel(low.x() - kRounding, from_.width());
  const int x1 = pixel(high.x() + kRounding, from_.width());
  const int y0 = pixel(low.y() - kRounding, from_.height());
  const int y1 = pixel(high.y() + kRounding, from_.height());
  if (std::int64_t{x1 - x0} * (y1 - y0) > kMaxPixels) return true;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      if (from_(x, y) <= high.z() && to_(x, y) >= low.z()) return true;
    }
  }
  return false;
}

MeshBlock MeshBlockOf(const BlockPlace& place, double voxel, int min_views,
                      const SurfaceList& views) {
  const Lattice lattice(place, voxel, min_views, views);
  MeshBlock block;
  for (int i = 0; i < kBlockSide * kBlockSide * kBlockSide; ++i) {
    const Eigen::Vector3i at(i % kBlockSide, i / kBlockSide % kBlockSide,
                             i / (kBlockSide * kBlockSide));
    const auto number = static_cast<std::uint16_t>(i);
    MeshBlock::Vertex vertex;
    if (lattice.VertexOf(at, vertex)) {
      vertex.cell = number;
      block.vertices.push_back(vertex);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const float a = lattice.At(at), b = lattice.At(at + Eigen::Vector3i::Unit(axis));
      if (std::isnan(a) || std::isnan(b) || (a < 0) == (b < 0)) continue;
      block.quads.push_back({number, static_cast<std::uint8_t>(axis), a < 0});
    }
  }
  return block;
}

}  // namespace dtr::pipeline
