#include "pipeline/detail/export/mesh_blocks.h"

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
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// Cosine between the ray and the normal where the ray of a pixel meets the surface; 0 where the
// neighbours are of no one surface with it.
double CosineAt(const SurfaceView& surface, int x, int y, const Eigen::Vector3d& ray) {
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
  const double across = slope(1, 0) * surface.camera.fx_px();
  const double down = slope(0, 1) * surface.camera.fy_px();
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
