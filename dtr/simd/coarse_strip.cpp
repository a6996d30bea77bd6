#include "dtr/simd/coarse_strip.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/simd/coarse_strip.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::simd::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(DF()));

// As in coarse_triangles.comp: pixels this near to an edge belong to the triangle, so that rounding
// leaves no cracks; thinner triangles and backs are not drawn.
constexpr float kMarginPx = 1.0f / 256, kMinArea = 1e-6f;
/// Pixel ranges never reach farther, so that they fit an int.
constexpr float kFarPx = 1e6f;
/// Of a direction whose z is 1 in its own view. Nearer to the plane of the eye a corner lies so far
/// aside (beyond 89.4 degrees) that float does not hold what it spans: triangles are cut there.
constexpr float kMinZ = 1e-2f;

HWY_INLINE int Ceil(float value) {
  const float v = std::clamp(value, -1.0f, kFarPx);
  const int i = static_cast<int>(v);
  return i + (static_cast<float>(i) < v);
}
HWY_INLINE int Floor(float value) {
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
  bool InFront(const Eigen::Vector3f& p, float w) const {
    return p.z() >= kMinZ && p.z() >= near_z * w;
  }
};

struct Strip : CoarseStrip {
  explicit Strip(const CoarseStrip& strip) : CoarseStrip(strip) {}

  float* RowAt(int y) const {
    return pixels + static_cast<size_t>(y - first) * static_cast<size_t>(width);
  }

  void Triangle(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c) const {
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
    if (!(area > kMinArea)) return;
    const float abw = b.inverse_depth - a.inverse_depth, acw = c.inverse_depth - a.inverse_depth;
    const float per_area = 1 / area;
    const Plane plane{a.x,
                      a.y,
                      a.inverse_depth,
                      (abw * acy - acw * aby) * per_area,
                      (acw * abx - abw * acx) * per_area,
                      std::min({a.inverse_depth, b.inverse_depth, c.inverse_depth}),
                      std::max({a.inverse_depth, b.inverse_depth, c.inverse_depth})};
    if (right - left < kLanes && kLanes <= width) {
      const Edge edges[3] = {{a, abx, aby}, {b, c.x - b.x, c.y - b.y}, {c, -acx, -acy}};
      Small(edges, plane, left, right, y0, y1);
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
      if (!(start <= end)) continue;
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

  /// A side of a triangle that runs clockwise: pixels whose centres are at along_x dy - along_y dx
  /// >= reach from (x, y) are inside of it.
  struct Edge {
    float x, y, along_x, along_y, reach;
    Edge(const ScreenPoint& from, float to_x, float to_y)
        : x(from.x),
          y(from.y),
          along_x(to_x),
          along_y(to_y),
          reach(-kMarginPx * (std::abs(to_x) + std::abs(to_y))) {}
  };

  /// A triangle whose columns one vector holds: a row at once.
  void Small(const Edge* edges, const Plane& plane, int left, int right, int top,
             int bottom) const {
    const DF d;
    const auto constant = [d](float value) { return hn::Set(d, value); };
    // Within the row, so that nothing of another thread's rows is read and written back.
    const int begin = std::min(left, width - kLanes);
    const VF x = hn::Iota(d, static_cast<float>(begin) + 0.5f);
    const auto asked = hn::And(hn::Gt(x, constant(static_cast<float>(left))),
                               hn::Lt(x, constant(static_cast<float>(right + 1))));
    VF across[3];  // what a pixel's column adds to an edge's distance
    for (int k = 0; k < 3; ++k) {
      across[k] = hn::MulAdd(constant(edges[k].along_y), hn::Sub(x, constant(edges[k].x)),
                             constant(edges[k].reach));
    }
    const VF w_across =
        hn::MulAdd(constant(plane.along_x), hn::Sub(x, constant(plane.x)), constant(plane.w));
    const VF farther = constant(plane.farther), nearer = constant(plane.nearer);
    float* row = RowAt(top) + begin;
    for (int y = top; y <= bottom; ++y, row += width) {
      const float centre = static_cast<float>(y) + 0.5f;
      auto inside = asked;
      for (int k = 0; k < 3; ++k) {
        inside =
            hn::And(inside, hn::Ge(constant(edges[k].along_x * (centre - edges[k].y)), across[k]));
      }
      const VF w = hn::Add(w_across, constant(plane.along_y * (centre - plane.y)));
      const VF kept = hn::Min(hn::Max(w, farther), nearer);
      hn::StoreU(hn::Max(hn::LoadU(d, row), hn::IfThenElseZero(inside, kept)), d, row);
    }
  }

  /// The same, row by row: where it goes down it bounds rows on the right, else on the left.
  struct Side {
    float start, end, start_step, end_step;
    Side(const ScreenPoint& from, float to_x, float to_y, float first_centre) {
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
      corner[k].beyond =
          corner[k].p.z() - std::max(placement.near_z * w, static_cast<double>(kMinZ));
    }
    ScreenPoint polygon[4];
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
    const float per_z = 1 / p.z(), x = p.x() * per_z, y = p.y() * per_z;
    const auto derivative = [&](int axis, float slope) -> Eigen::Vector2f {
      const Eigen::Vector3f d = 2 * placement.from_grid.col(axis) + placement.from_centre * slope;
      return {(d.x() - x * d.z()) * per_z, (d.y() - y * d.z()) * per_z};
    };
    const Eigen::Vector2f du = derivative(0, cell.slope_x), dv = derivative(1, cell.slope_y);
    if (!(du.x() * dv.y() - du.y() * dv.x() > 0)) return;  // SPEC 2.4
    const float extent =
        std::max(std::abs(du.x()) + std::abs(dv.x()), std::abs(du.y()) + std::abs(dv.y()));
    const float half = std::min(0.5f * extent, static_cast<float>(kLargestHalfCellPx));
    const float inverse_depth = w * per_z;
    const int x0 = std::max(0, Ceil(x - half - 0.5f));
    const int x1 = std::min(width - 1, Floor(x + half - 0.5f));
    const int y1 = std::min(last, Floor(y + half - 0.5f));
    for (int v = std::max(first, Ceil(y - half - 0.5f)); v <= y1; ++v) {
      float* row = RowAt(v);
      for (int u = x0; u <= x1; ++u) row[u] = std::max(row[u], inverse_depth);
    }
  }

  void Mesh(const AdaptiveMesh& mesh, const GridPlacement& grid,
            const std::vector<ScreenPoint>& points) const {
    const FloatPlacement placement(grid);
    for (const AdaptiveMesh::Tile& tile : mesh.tiles) {
      if (!MayBeSeen(tile, grid, width, {first, last - first + 1})) continue;
      for (int t = tile.first_triangle; t < tile.first_triangle + tile.triangle_count; ++t) {
        const std::uint32_t* index = &mesh.indices[3 * static_cast<size_t>(t)];
        const ScreenPoint &a = points[index[0]], &b = points[index[1]], &c = points[index[2]];
        if (a.inverse_depth > 0 && b.inverse_depth > 0 && c.inverse_depth > 0) {
          Triangle(a, b, c);
        } else if (a.inverse_depth > 0 || b.inverse_depth > 0 || c.inverse_depth > 0) {
          const AdaptiveMesh::Vertex* corners[3] = {
              &mesh.vertices[index[0]], &mesh.vertices[index[1]], &mesh.vertices[index[2]]};
          Clipped(corners, grid);
        }
      }
      for (int i = tile.first_cell; i < tile.first_cell + tile.cell_count; ++i) {
        Cell(mesh.cells[static_cast<size_t>(i)], placement);
      }
    }
  }
};

void DrawImpl(const AdaptiveMesh& mesh, const GridPlacement& placement,
              const std::vector<ScreenPoint>& points, const CoarseStrip& strip) {
  Strip(strip).Mesh(mesh, placement, points);
}

/// As FloatPlacement has it, several vertices at once.
void ProjectImpl(const AdaptiveMesh& mesh, const GridPlacement& grid, ScreenPoint* points) {
  const FloatPlacement placement(grid);
  const auto& vertices = mesh.vertices;
  HWY_ALIGN float x[kLanes], y[kLanes], w[kLanes];
  const DF d;
  for (size_t first = 0; first < vertices.size(); first += kLanes) {
    const size_t count = std::min<size_t>(kLanes, vertices.size() - first);
    for (size_t i = 0; i < kLanes; ++i) {
      const AdaptiveMesh::Vertex& v = vertices[first + std::min(i, count - 1)];
      x[i] = v.x, y[i] = v.y, w[i] = v.inverse_depth;
    }
    const VF vx = hn::Load(d, x), vy = hn::Load(d, y), vw = hn::Load(d, w);
    const auto at = [&](int row) {
      const Eigen::Matrix3f& m = placement.from_grid;
      const VF plane =
          hn::Add(hn::Mul(hn::Set(d, m(row, 0)), vx), hn::Mul(hn::Set(d, m(row, 1)), vy));
      return hn::Add(hn::Add(plane, hn::Set(d, m(row, 2))),
                     hn::Mul(hn::Set(d, placement.from_centre[row]), vw));
    };
    const VF z = at(2), per_z = hn::Div(hn::Set(d, 1.0f), z);
    const auto in_front =
        hn::And(hn::Ge(z, hn::Set(d, kMinZ)), hn::Ge(z, hn::Mul(hn::Set(d, placement.near_z), vw)));
    hn::Store(hn::Mul(at(0), per_z), d, x);
    hn::Store(hn::Mul(at(1), per_z), d, y);
    hn::Store(hn::IfThenElseZero(in_front, hn::Mul(vw, per_z)), d, w);
    for (size_t i = 0; i < count; ++i) points[first + i] = {x[i], y[i], w[i]};
  }
}

}  // namespace dtr::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::simd {

HWY_EXPORT(DrawImpl);
HWY_EXPORT(ProjectImpl);

void ProjectVertices(const AdaptiveMesh& mesh, const GridPlacement& placement,
                     std::vector<ScreenPoint>& points) {
  points.resize(mesh.vertices.size());
  HWY_DYNAMIC_DISPATCH(ProjectImpl)(mesh, placement, points.data());
}

void DrawIntoStrip(const AdaptiveMesh& mesh, const GridPlacement& placement,
                   const std::vector<ScreenPoint>& points, const CoarseStrip& strip) {
  HWY_DYNAMIC_DISPATCH(DrawImpl)(mesh, placement, points, strip);
}

}  // namespace dtr::simd
#endif
