#include "dtr/cpu/layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "dtr/cpu/raster.h"
#include "dtr/render/closed_cells.h"
#include "dtr/render/scene.h"
#include "dtr/render/triangulation.h"

namespace dtr::cpu {
namespace {

// Splats beyond this are the novel camera touching the surface; it bounds the work (SPEC 3.2).
constexpr double kMaxSplatHalfPx = 32;

/// A sample seen from the novel camera.
struct Vertex {
  ScreenVertex screen;
  bool exists = false;
  bool in_front = false;  ///< beyond the near plane; only then `screen` is set
};

class ViewPainter {
 public:
  ViewPainter(const ViewInNovel& view_in_novel, const PinholeCamera& novel,
              const RenderOptions& options, const Band& band)
      : in_novel_(view_in_novel),
        novel_(novel),
        depth_camera_(view_in_novel.view->DepthCamera()),
        samples_(MakeSampleGrid(*view_in_novel.view, options.resolution)),
        rule_(BreakRuleOf(*view_in_novel.view, options)),
        point_size_(options.point_size),
        layer_(band) {}

  Layer TakeLayer() { return std::move(layer_); }

  void PaintMesh() {
    if (samples_.inverse_depth.empty()) return;
    const int columns = samples_.inverse_depth.width(), rows = samples_.inverse_depth.height();
    std::vector<Vertex> above, below;
    // One row and column of empty samples around the grid closes its border cells (SPEC 2.6).
    for (int j = -1; j < rows; ++j) {
      std::swap(above, below);
      below = ProjectRow(j + 1);
      if (j == -1) above.assign(below.size(), Vertex{});
      for (int i = -1; i < columns; ++i) PaintBlock(i, j, above, below);
    }
  }

  /// SPEC 5.1; requires a point size of 1.
  void PaintReducedMesh(const AdaptiveMesh& mesh) {
    std::vector<SurfacePoint> points;
    std::vector<Vertex> vertices;
    for (const AdaptiveMesh::Vertex& v : mesh.vertices) {
      points.push_back({mesh.DepthPixel(v.x), mesh.DepthPixel(v.y), v.inverse_depth});
      vertices.push_back(ProjectAt(points.back()));
    }
    for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const std::uint32_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
      PaintTriangle({&vertices[a], &vertices[b], &vertices[c]}, {points[a], points[b], points[c]});
    }
    for (const AdaptiveMesh::Cell& cell : mesh.cells) {
      const int i = (cell.x - 1) / 2, j = (cell.y - 1) / 2;
      const Vertex vertex = ProjectAt(PointOf(i, j));
      if (vertex.in_front) PaintSplat(i, j, vertex.screen);
    }
  }

  void PaintSplats() {
    if (samples_.inverse_depth.empty()) return;
    for (int j = 0; j < samples_.inverse_depth.height(); ++j) {
      const std::vector<Vertex> row = ProjectRow(j);
      for (int i = 0; i < samples_.inverse_depth.width(); ++i) {
        const Vertex& vertex = row[static_cast<size_t>(i + 1)];
        if (vertex.in_front) PaintSplat(i, j, vertex.screen);
      }
    }
  }

 private:
  double InverseDepth(int i, int j) const {
    return samples_.inverse_depth.Contains(i, j) ? samples_.inverse_depth(i, j) : 0;
  }

  /// The point at depth-grid pixel (u, v), times its inverse depth in the view, in the novel frame.
  Eigen::Vector3d Homogeneous(double u, double v, double inverse_depth) const {
    return in_novel_.rotation * depth_camera_.RayFromPixel({u, v}) +
           in_novel_.translation * inverse_depth;
  }

  bool InFront(const Eigen::Vector3d& q, double inverse_depth) const {
    return q.z() > 0 && q.z() >= in_novel_.near_z * inverse_depth;
  }

  /// SPEC 2.4; requires InFront. The division by z is the only one.
  ScreenVertex Screen(const Eigen::Vector3d& q, double inverse_depth) const {
    const double inverse = 1 / q.z();
    return {SnapToSubpixel(novel_.fx_px() * (q.x() * inverse) + novel_.cx_px()),
            SnapToSubpixel(novel_.fy_px() * (q.y() * inverse) + novel_.cy_px()),
            inverse_depth * inverse};
  }

  SurfacePoint PointOf(int i, int j) const {
    return {samples_.Centre(i), samples_.Centre(j), samples_.inverse_depth(i, j)};
  }

  Vertex ProjectAt(const SurfacePoint& point) const {
    Vertex vertex;
    vertex.exists = point.inverse_depth > 0;
    if (!vertex.exists) return vertex;
    const Eigen::Vector3d q = Homogeneous(point.u, point.v, point.inverse_depth);
    vertex.in_front = InFront(q, point.inverse_depth);
    if (vertex.in_front) vertex.screen = Screen(q, point.inverse_depth);
    return vertex;
  }

  /// Samples -1 ... columns of row j; the ends, and rows off the grid, do not exist.
  std::vector<Vertex> ProjectRow(int j) const {
    const int columns = samples_.inverse_depth.width();
    std::vector<Vertex> row(static_cast<size_t>(columns) + 2);
    if (j < 0 || j >= samples_.inverse_depth.height()) return row;
    for (int i = 0; i < columns; ++i) {
      row[static_cast<size_t>(i + 1)] = ProjectAt(PointOf(i, j));
    }
    return row;
  }

  void PaintBlock(int i, int j, const std::vector<Vertex>& above,
                  const std::vector<Vertex>& below) {
    const size_t left = static_cast<size_t>(i + 1);
    const Vertex* corner[4] = {&above[left], &above[left + 1], &below[left], &below[left + 1]};
    if (!corner[0]->exists && !corner[1]->exists && !corner[2]->exists && !corner[3]->exists) {
      return;
    }
    const Grid<double>& w = samples_.inverse_depth;
    const bool inside = i >= 0 && j >= 0 && i + 1 < w.width() && j + 1 < w.height();
    const BlockTriangles block = inside ? TrianglesOfBlock(w, i, j, rule_) : BlockTriangles{};
    for (const std::uint8_t corners : block.corners) {
      if (corners != 0) PaintTriangleOfBlock(i, j, corners, corner);
    }
    const std::uint8_t open = OpenCorners(block);
    for (int c = 0; c < 4; ++c) {
      if (corner[c]->in_front && (open & (1 << c))) PaintQuarterCell(i, j, c);
    }
  }

  void PaintTriangleOfBlock(int i, int j, std::uint8_t corners, const Vertex* const (&corner)[4]) {
    // Clockwise on the screen of the view, y down: A B D C without the missing corner.
    std::array<const Vertex*, 3> vertices{};
    std::array<SurfacePoint, 3> points;
    size_t count = 0;
    for (const int c : {0, 1, 3, 2}) {
      if ((corners & (1 << c)) == 0) continue;
      points[count] = PointOf(i + (c & 1), j + (c >> 1));
      vertices[count++] = corner[c];
    }
    PaintTriangle(vertices, points);
  }

  void PaintTriangle(const std::array<const Vertex*, 3>& vertices,
                     const std::array<SurfacePoint, 3>& points) {
    const auto& [a, b, c] = vertices;
    const int in_front = a->in_front + b->in_front + c->in_front;
    if (in_front == 3) {
      DrawTriangle(a->screen, b->screen, c->screen, layer_);
    } else if (in_front > 0) {
      PaintClipped(points);
    }
  }

  /// SPEC 2.5: the part of a triangle beyond the near plane, Sutherland and Hodgman 1974.
  void PaintClipped(const std::array<SurfacePoint, 3>& points) {
    Eigen::Vector3d point[3];
    for (size_t k = 0; k < 3; ++k) {
      const auto& [u, v, w] = points[k];
      point[k] = Homogeneous(u, v, w) / w;
    }
    std::array<ScreenVertex, 4> polygon;
    size_t count = 0;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d &from = point[k], &to = point[(k + 1) % 3];
      const bool from_in = from.z() >= in_novel_.near_z, to_in = to.z() >= in_novel_.near_z;
      if (from_in) polygon[count++] = Screen(from, 1);
      if (from_in != to_in) {
        const double share = (in_novel_.near_z - from.z()) / (to.z() - from.z());
        Eigen::Vector3d cut = from + share * (to - from);
        cut.z() = in_novel_.near_z;
        polygon[count++] = Screen(cut, 1);
      }
    }
    for (size_t k = 2; k < count; ++k) {
      DrawTriangle(polygon[0], polygon[k - 1], polygon[k], layer_);
    }
  }

  /// SPEC 2.6: the quarter of the sample's cell that lies in block (i, j), on its local plane.
  void PaintQuarterCell(int i, int j, int corner) {
    const auto cell = QuarterCell(samples_, i + (corner & 1), j + (corner >> 1), corner, rule_);
    std::array<Vertex, 4> v;
    for (size_t k = 0; k < 4; ++k) {
      v[k] = ProjectAt(cell[k]);
      if (!v[k].in_front) return;
    }
    DrawTriangle(v[0].screen, v[1].screen, v[3].screen, layer_);
    DrawTriangle(v[0].screen, v[3].screen, v[2].screen, layer_);
  }

  double Slope(int i, int j, int dx, int dy) const {
    return LocalSlope(samples_.inverse_depth, i, j, dx, dy, rule_);
  }

  /// SPEC 3.1: a square as large as the sample's cell on its local plane.
  void PaintSplat(int i, int j, const ScreenVertex& screen) {
    const double w = InverseDepth(i, j), step = samples_.step;
    const Eigen::Vector3d q = Homogeneous(samples_.Centre(i), samples_.Centre(j), w);
    const Eigen::Vector3d qu = in_novel_.rotation.col(0) * (step / depth_camera_.fx_px()) +
                               in_novel_.translation * Slope(i, j, 1, 0);
    const Eigen::Vector3d qv = in_novel_.rotation.col(1) * (step / depth_camera_.fy_px()) +
                               in_novel_.translation * Slope(i, j, 0, 1);
    const auto derivative = [&](const Eigen::Vector3d& dq) -> Eigen::Vector2d {
      return {novel_.fx_px() * (dq.x() - q.x() / q.z() * dq.z()) / q.z(),
              novel_.fy_px() * (dq.y() - q.y() / q.z() * dq.z()) / q.z()};
    };
    const Eigen::Vector2d du = derivative(qu), dv = derivative(qv);
    if (!(du.x() * dv.y() - du.y() * dv.x() > 0)) return;  // SPEC 2.4: the back of a surface
    const double extent =
        std::max(std::abs(du.x()) + std::abs(dv.x()), std::abs(du.y()) + std::abs(dv.y()));
    const double half = std::min(0.5 * point_size_ * extent, kMaxSplatHalfPx);
    DrawSquare(screen, half, layer_);
  }

  const ViewInNovel& in_novel_;
  const PinholeCamera& novel_;
  const PinholeCamera depth_camera_;
  const SampleGrid samples_;
  const BreakRule rule_;
  const double point_size_;
  Layer layer_;
};

}  // namespace

Layer DrawView(const ViewInNovel& view_in_novel, const PinholeCamera& novel,
               const RenderOptions& options, const Band& band) {
  ViewPainter painter(view_in_novel, novel, options, band);
  if (options.primitive == Primitive::kMesh) {
    painter.PaintMesh();
  } else {
    painter.PaintSplats();
  }
  return painter.TakeLayer();
}

Layer DrawReducedMesh(const ViewInNovel& view_in_novel, const AdaptiveMesh& mesh,
                      const PinholeCamera& novel, const RenderOptions& options, const Band& band) {
  RenderOptions drawn = options;
  drawn.point_size = 1;
  ViewPainter painter(view_in_novel, novel, drawn, band);
  painter.PaintReducedMesh(mesh);
  return painter.TakeLayer();
}

}  // namespace dtr::cpu
