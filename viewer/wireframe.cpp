#include "viewer/wireframe.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "dtr/base/parallel_for.h"

namespace dtr::viewer {
namespace {

constexpr int kRowsTogether = 64;
constexpr int kImageShare = 3;  // one part in so many of the image's brightness stays

RenderOptions MeshOptions(RenderOptions options) {
  if (options.method != RenderMethod::kDeferred) options.mesh_tolerance_px = 0;
  return options;
}

/// An end of an edge in the image: pixels, and 1/z, which is straight along a projected line.
struct End {
  Eigen::Vector3d at{0, 0, 0};  ///< x, y, 1/z
  bool in_front = false;
};

End Project(const NovelCamera& camera, const Eigen::Vector3d& p_in_world) {
  const Eigen::Vector3d p_in_cam = camera.cam_from_world * p_in_world;
  const auto pixel = camera.camera.PixelFromCam(p_in_cam);
  if (!pixel || !pixel->allFinite()) return {};
  return {{pixel->x(), pixel->y(), 1 / p_in_cam.z()}, true};
}

/// Rows [first, end) of the image that is drawn over.
struct Rows {
  int first = 0, end = 0;
};

struct Pen {
  const DepthImage& surface;
  ImageRgb8& image;
  double delta;  ///< of 1/z
  std::array<std::uint8_t, 3> colour;

  void Dot(double x_px, double y_px, double inverse_depth, const Rows& rows) const {
    if (!(x_px >= 0) || !(x_px < image.width()) || !(y_px >= rows.first) || !(y_px < rows.end)) {
      return;
    }
    const int x = static_cast<int>(x_px), y = static_cast<int>(y_px);
    const float z = surface(x, y);
    if (DepthImage::IsHole(z) || inverse_depth + delta < 1 / static_cast<double>(z)) return;
    for (int c = 0; c < 3; ++c) image(x, y, c) = colour[static_cast<size_t>(c)];
  }

  /// One dot for every pixel along the longer axis. Which pixels these are does not depend on the
  /// rows.
  void Line(const End& a, const End& b, const Rows& rows) const {
    const Eigen::Vector3d way = b.at - a.at;
    if (std::max(a.at.y(), b.at.y()) < rows.first || std::min(a.at.y(), b.at.y()) >= rows.end) {
      return;
    }
    const int axis = std::abs(way.x()) >= std::abs(way.y()) ? 0 : 1;
    if (std::abs(way[axis]) < 1) {  // within a pixel or two
      return Dot(a.at.x(), a.at.y(), a.at.z(), rows);
    }
    const double low = axis == 0 ? 0 : rows.first, high = axis == 0 ? image.width() : rows.end;
    const double from = std::max(low, std::floor(std::min(a.at[axis], b.at[axis])));
    const double to = std::min(high - 1, std::floor(std::max(a.at[axis], b.at[axis])));
    for (double pixel = from; pixel <= to; ++pixel) {
      const double share = std::clamp((pixel + 0.5 - a.at[axis]) / way[axis], 0.0, 1.0);
      const Eigen::Vector3d here = a.at + share * way;
      Dot(here.x(), here.y(), here.z(), rows);
    }
  }
};

std::vector<std::pair<std::uint32_t, std::uint32_t>> EdgesOf(const AdaptiveMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(mesh.indices.size());
  for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(mesh.indices[i + k], mesh.indices[i + (k + 1) % 3]);
      edges.emplace_back(low, high);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  edges.shrink_to_fit();
  return edges;
}

std::vector<Eigen::Vector3d> PointsOf(const AdaptiveMesh& mesh, const View& view) {
  const PinholeCamera camera = view.DepthCamera();
  const Pose world_from_cam = view.cam_from_world.Inverse();
  std::vector<Eigen::Vector3d> points;
  points.reserve(mesh.vertices.size());
  for (const AdaptiveMesh::Vertex& vertex : mesh.vertices) {
    const Eigen::Vector3d ray =
        camera.RayFromPixel({mesh.DepthPixel(vertex.x), mesh.DepthPixel(vertex.y)});
    // What lies at infinity or beyond is drawn nowhere: PixelFromCam rejects it.
    points.push_back(world_from_cam * (ray / static_cast<double>(vertex.inverse_depth)));
  }
  return points;
}

}  // namespace

void Wireframe::Keep(const Drawn& drawn) {
  const RenderOptions options = MeshOptions(drawn.options);
  std::map<const View*, Kept> needed;
  std::vector<const View*> missing;
  for (const int index : drawn.result.views_used) {
    const View* view = drawn.scene.views[static_cast<size_t>(index)];
    const auto found = meshes_.find(view);
    if (found != meshes_.end() && found->second.resolution == options.resolution &&
        found->second.rule == MeshRuleOf(*view, options) &&
        found->second.depth_data == view->depth.grid().data().data()) {
      needed[view] = std::move(found->second);
    } else {
      missing.push_back(view);
    }
  }
  std::vector<Kept> made(missing.size());
  ParallelFor(0, static_cast<int>(missing.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    const View& view = *missing[k];
    std::string unfit;  // the renderer has said so
    const AdaptiveMesh mesh = MakeAdaptiveMesh(view, options, unfit);
    made[k] = {options.resolution, MeshRuleOf(view, options), view.depth.grid().data().data(),
               PointsOf(mesh, view), EdgesOf(mesh)};
  });
  for (size_t k = 0; k < missing.size(); ++k) needed[missing[k]] = std::move(made[k]);
  meshes_ = std::move(needed);
}

ImageRgb8 Wireframe::Draw(const Drawn& drawn) {
  Keep(drawn);
  ImageRgb8 image = drawn.result.image;
  for (std::uint8_t& value : image.data()) value /= kImageShare;
  const std::vector<int>& nearest_first = drawn.result.views_used;
  const int height = image.height(), bands = (height + kRowsTogether - 1) / kRowsTogether;
  for (size_t k = nearest_first.size(); k-- > 0;) {
    const View& view = *drawn.scene.views[static_cast<size_t>(nearest_first[k])];
    const Kept& mesh = meshes_.at(&view);
    std::vector<End> ends(mesh.points.size());
    constexpr int kPointsTogether = 4096;
    const auto points = static_cast<int>(mesh.points.size());
    ParallelFor(0, (points + kPointsTogether - 1) / kPointsTogether, [&](int piece) {
      const int end = std::min(points, (piece + 1) * kPointsTogether);
      for (int i = piece * kPointsTogether; i < end; ++i) {
        const auto p = static_cast<size_t>(i);
        ends[p] = Project(drawn.camera, mesh.points[p]);
      }
    });
    const Pen pen{drawn.result.depth, image, ThresholdsOf(view, drawn.options).delta,
                  drawn.colours.Of(view)};
    ParallelFor(0, bands, [&](int band) {
      const Rows rows{band * kRowsTogether, std::min(height, (band + 1) * kRowsTogether)};
      for (const auto& [a, b] : mesh.edges) {
        if (ends[a].in_front && ends[b].in_front) pen.Line(ends[a], ends[b], rows);
      }
    });
  }
  return image;
}

}  // namespace dtr::viewer
