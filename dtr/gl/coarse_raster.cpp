#include "dtr/gl/coarse_raster.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"
#include "dtr/gl/triangle_kernel.h"

namespace dtr::gl {
namespace {

// As in coarse_triangles.comp: pixels this near to an edge belong to the triangle, so that rounding
// leaves no cracks; thinner triangles and backs are not drawn.
constexpr float kMarginPx = 1.0f / 64, kLeastArea = 1e-6f;
// Strips of rows are drawn at once; thinner ones would set up too many triangles twice.
constexpr int kFewestRows = 64;

/// Pixel ranges never reach farther, so that they fit an int.
constexpr float kFarPx = 1e6f;

int Ceil(float value) {
  const float v = std::clamp(value, -1.0f, kFarPx);
  const int i = static_cast<int>(v);
  return i + (static_cast<float>(i) < v);
}
int Floor(float value) {
  const float v = std::clamp(value, -1.0f, kFarPx);
  const int i = static_cast<int>(v);
  return i - (static_cast<float>(i) > v);
}

/// A placement in single precision.
struct FloatPlacement {
  Eigen::Matrix3f from_grid;
  Eigen::Vector3f from_centre;
  float near_z;
  explicit FloatPlacement(const GridPlacement& p)
      : from_grid(p.from_grid.cast<float>()),
        from_centre(p.from_centre.cast<float>()),
        near_z(static_cast<float>(p.near_z)) {}
  Eigen::Vector3f At(float x, float y, float w) const {
    return from_grid.col(0) * x + from_grid.col(1) * y + from_grid.col(2) + from_centre * w;
  }
  bool InFront(const Eigen::Vector3f& p, float w) const { return p.z() > 0 && p.z() >= near_z * w; }
};

}  // namespace

/// Rows [first, last] of the picture.
struct CoarseRaster::Strip {
  float* pixels;  ///< of the first row
  int width, first, last;
  int small_px;  ///< triangles of up to so many columns are drawn a row at once

  float* RowAt(int y) const {
    return pixels + static_cast<size_t>(y - first) * static_cast<size_t>(width);
  }

  void Triangle(const Point& a, const Point& b, const Point& c) const {
    const float low_y = std::min({a.y, b.y, c.y}), high_y = std::max({a.y, b.y, c.y});
    // Everything starts from the triangle's own rows: strips must not change a digit.
    const int top = Ceil(low_y - kMarginPx - 0.5f), bottom = Floor(high_y + kMarginPx - 0.5f);
    const int y0 = std::max(first, top), y1 = std::min(last, bottom);
    if (y0 > y1) return;
    const float low_x = std::min({a.x, b.x, c.x}), high_x = std::max({a.x, b.x, c.x});
    const int left = std::max(0, Ceil(low_x - kMarginPx - 0.5f));
    const int right = std::min(width - 1, Floor(high_x + kMarginPx - 0.5f));
    if (left > right) return;
    const float abx = b.x - a.x, aby = b.y - a.y, acx = c.x - a.x, acy = c.y - a.y;
    const float area = abx * acy - aby * acx;
    if (!(area > kLeastArea)) return;
    const float abw = b.inverse_depth - a.inverse_depth, acw = c.inverse_depth - a.inverse_depth;
    const float per_area = 1 / area;
    const Plane plane{a.x,
                      a.y,
                      a.inverse_depth,
                      (abw * acy - acw * aby) * per_area,
                      (acw * abx - abw * acx) * per_area,
                      std::min({a.inverse_depth, b.inverse_depth, c.inverse_depth}),
                      std::max({a.inverse_depth, b.inverse_depth, c.inverse_depth})};
    if (right - left < small_px) {
      const SmallTriangle triangle{
          {Edge(a, abx, aby), Edge(b, c.x - b.x, c.y - b.y), Edge(c, -acx, -acy)},
          plane.x,
          plane.y,
          plane.w,
          plane.along_x,
          plane.along_y,
          plane.farther,
          plane.nearer,
          left,
          right,
          y0,
          y1};
      DrawSmallTriangle(triangle, RowAt(y0), width);
      return;
    }
    const float first_centre = static_cast<float>(top) + 0.5f;
    const Side sides[3] = {{a, abx, aby, first_centre},
                           {b, c.x - b.x, c.y - b.y, first_centre},
                           {c, -acx, -acy, first_centre}};
    for (int y = y0; y <= y1; ++y) {
      const auto r = static_cast<float>(y - top);
      const float start = std::max({sides[0].StartAt(r), sides[1].StartAt(r), sides[2].StartAt(r)});
      const float end = std::min({sides[0].EndAt(r), sides[1].EndAt(r), sides[2].EndAt(r)});
      const int x1 = std::min(right, Floor(end - 0.5f));
      const int x0 = std::max(left, Ceil(start - 0.5f));
      float* row = RowAt(y) + x0;
      const float w = plane.Unbounded(x0, y), along_x = plane.along_x;
      const float farther = plane.farther, nearer = plane.nearer;
      for (int i = 0; i <= x1 - x0; ++i) {
        const float here = w + along_x * static_cast<float>(i);
        row[i] = std::max(row[i], std::min(std::max(here, farther), nearer));
      }
    }
  }

  /// A triangle's inverse depth, linear on the screen, within that of its corners.
  struct Plane {
    float x, y, w, along_x, along_y, farther, nearer;
    float Unbounded(int px, int py) const {
      return w + along_x * (static_cast<float>(px) + 0.5f - x) +
             along_y * (static_cast<float>(py) + 0.5f - y);
    }
  };

  /// A side of a triangle that runs clockwise.
  static SmallTriangle::Side Edge(const Point& from, float to_x, float to_y) {
    return {from.x, from.y, to_x, to_y, -kMarginPx * (std::abs(to_x) + std::abs(to_y))};
  }

  /// The same, row by row: where it goes down it bounds rows on the right, else on the left.
  struct Side {
    float start, end, start_step, end_step;
    Side(const Point& from, float to_x, float to_y, float first_centre) {
      const float across = to_y == 0 ? 0 : to_x / to_y;
      const float at = from.x + across * (first_centre - from.y);
      const float reach = kMarginPx * (1 + std::abs(across));
      start = to_y < 0 ? at - reach : -1;
      start_step = to_y < 0 ? across : 0;
      end = to_y > 0 ? at + reach : kFarPx;
      end_step = to_y > 0 ? across : 0;
    }
    float StartAt(float row) const { return start + start_step * row; }
    float EndAt(float row) const { return end + end_step * row; }
  };

  /// SPEC 2.5, for triangles that cross the near plane.
  void Clipped(const AdaptiveMesh::Vertex* const* corners, const GridPlacement& placement) const {
    struct Corner {
      Eigen::Vector3d p;
      double w, beyond;  ///< beyond: the near plane
    };
    Corner corner[3];
    for (int k = 0; k < 3; ++k) {
      const double w = corners[k]->inverse_depth;
      corner[k].p = placement.from_grid * Eigen::Vector3d(corners[k]->x, corners[k]->y, 1) +
                    placement.from_centre * w;
      corner[k].w = w;
      corner[k].beyond = corner[k].p.z() - placement.near_z * w;
    }
    Point polygon[4];
    int n = 0;
    const auto add = [&](const Eigen::Vector3d& p, double w) {
      polygon[n++] = {static_cast<float>(p.x() / p.z()), static_cast<float>(p.y() / p.z()),
                      static_cast<float>(w / p.z())};
    };
    for (int k = 0; k < 3; ++k) {
      const Corner &here = corner[k], &next = corner[(k + 1) % 3];
      if (here.beyond >= 0) add(here.p, here.w);
      if ((here.beyond >= 0) == (next.beyond >= 0)) continue;
      // From the same end for both triangles at this side.
      const Corner &front = here.beyond >= 0 ? here : next, &back = here.beyond >= 0 ? next : here;
      const double t = front.beyond / (front.beyond - back.beyond);
      add(front.p + t * (back.p - front.p), front.w + t * (back.w - front.w));
    }
    for (int k = 1; k + 1 < n; ++k) Triangle(polygon[0], polygon[k], polygon[k + 1]);
  }

  /// As coarse_cells.comp.
  void Cell(const AdaptiveMesh::Cell& cell, const FloatPlacement& placement) const {
    const float w = cell.inverse_depth;
    const Eigen::Vector3f p = placement.At(cell.x, cell.y, w);
    if (!placement.InFront(p, w)) return;
    const auto derivative = [&](int axis, float slope) -> Eigen::Vector2f {
      const Eigen::Vector3f d = 2 * placement.from_grid.col(axis) + placement.from_centre * slope;
      return (d.head<2>() - p.head<2>() / p.z() * d.z()) / p.z();
    };
    const Eigen::Vector2f du = derivative(0, cell.slope_x), dv = derivative(1, cell.slope_y);
    if (!(du.x() * dv.y() - du.y() * dv.x() > 0)) return;  // SPEC 2.4
    const Eigen::Vector2f extent = du.cwiseAbs() + dv.cwiseAbs();
    const float half = std::min(0.5f * extent.maxCoeff(), static_cast<float>(kLargestHalfCellPx));
    const float x = p.x() / p.z(), y = p.y() / p.z(), inverse_depth = w / p.z();
    const int x0 = std::max(0, Ceil(x - half - 0.5f));
    const int x1 = std::min(width - 1, Floor(x + half - 0.5f));
    const int y1 = std::min(last, Floor(y + half - 0.5f));
    for (int v = std::max(first, Ceil(y - half - 0.5f)); v <= y1; ++v) {
      float* row = RowAt(v);
      for (int u = x0; u <= x1; ++u) row[u] = std::max(row[u], inverse_depth);
    }
  }

  void Mesh(const PlacedMesh& placed, const std::vector<Point>& points) const {
    const AdaptiveMesh& mesh = *placed.mesh;
    const FloatPlacement placement(placed.placement);
    for (const AdaptiveMesh::Tile& tile : mesh.tiles) {
      if (!MayBeSeen(tile, placed.placement, width, {first, last - first + 1})) continue;
      for (int t = tile.first_triangle; t < tile.first_triangle + tile.triangle_count; ++t) {
        const std::uint32_t* index = &mesh.indices[3 * static_cast<size_t>(t)];
        const Point &a = points[index[0]], &b = points[index[1]], &c = points[index[2]];
        if (a.inverse_depth > 0 && b.inverse_depth > 0 && c.inverse_depth > 0) {
          Triangle(a, b, c);
        } else if (a.inverse_depth > 0 || b.inverse_depth > 0 || c.inverse_depth > 0) {
          const AdaptiveMesh::Vertex* corners[3] = {
              &mesh.vertices[index[0]], &mesh.vertices[index[1]], &mesh.vertices[index[2]]};
          Clipped(corners, placed.placement);
        }
      }
      for (int i = tile.first_cell; i < tile.first_cell + tile.cell_count; ++i) {
        Cell(mesh.cells[static_cast<size_t>(i)], placement);
      }
    }
  }
};

void CoarseRaster::Project(const PlacedMesh& placed, std::vector<Point>& points) const {
  const FloatPlacement placement(placed.placement);
  const auto& vertices = placed.mesh->vertices;
  points.resize(vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    const AdaptiveMesh::Vertex& v = vertices[i];
    const Eigen::Vector3f p = placement.At(v.x, v.y, v.inverse_depth);
    const float per_z = 1 / p.z();
    points[i] = {p.x() * per_z, p.y() * per_z,
                 placement.InFront(p, v.inverse_depth) ? v.inverse_depth * per_z : 0};
  }
}

void CoarseRaster::Draw(const std::vector<PlacedMesh>& meshes, int width_px, const Band& band,
                        int threads) {
  points_.resize(meshes.size());
  ParallelFor(0, static_cast<int>(meshes.size()), threads, [&](int i) {
    const auto k = static_cast<size_t>(i);
    Project(meshes[k], points_[k]);
  });
  nearest_.assign(static_cast<size_t>(width_px) * static_cast<size_t>(band.count), 0);
  const int small_px = SmallTriangleWidth() <= width_px ? SmallTriangleWidth() : 0;
  const int most = std::max(1, band.count / kFewestRows);
  const int strips = std::min(most, ResolveThreads(threads));
  ParallelFor(0, strips, threads, [&](int s) {
    const int from = static_cast<int>(static_cast<long long>(band.count) * s / strips);
    const int to = static_cast<int>(static_cast<long long>(band.count) * (s + 1) / strips);
    const Strip strip{nearest_.data() + static_cast<size_t>(from) * static_cast<size_t>(width_px),
                      width_px, band.first + from, band.first + to - 1, small_px};
    for (size_t k = 0; k < meshes.size(); ++k) strip.Mesh(meshes[k], points_[k]);
  });
}

}  // namespace dtr::gl
