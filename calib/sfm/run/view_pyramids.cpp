#include "calib/sfm/run/view_pyramids.h"

#include <Eigen/Dense>
#include <algorithm>
#include <vector>

namespace dtr::sfm {
namespace {

using Eigen::Vector3d;

// What rounding may put a direction on the wrong side of a plane it lies in, of unit vectors.
constexpr double kRounding = 1e-12;

// The edges of the pyramid of view, unit vectors in the world.
std::vector<Vector3d> EdgesOf(const PosedImage& image) {
  const PinholeCamera camera = image.camera.Pinhole();
  const Eigen::Quaterniond world_from_cam = image.cam_from_world.rotation.conjugate();
  std::vector<Vector3d> edges;
  for (const double x : {-kPyramidMargin, 1 + kPyramidMargin}) {
    for (const double y : {-kPyramidMargin, 1 + kPyramidMargin}) {
      const Eigen::Vector2d corner(x * camera.width_px(), y * camera.height_px());
      edges.push_back(world_from_cam *
                      camera.CamFromPixel(corner, 1, DepthKind::kPlaneZ).normalized());
    }
  }
  return edges;
}

}  // namespace

bool CannotOverlap(const PosedImage& a, const PosedImage& b) {
  if (!a.camera.IsUndistorted() || !b.camera.IsUndistorted()) return false;
  // A plane with a lying below it and b above has a normal that makes no negative product with any
  // of these: b's edges, a's turned round, and the way from a's centre to b's. Normals that do are
  // a convex cone, and one that is not empty has an edge, which two of these span.
  std::vector<Vector3d> not_below = EdgesOf(b);
  for (const Vector3d& edge : EdgesOf(a)) not_below.push_back(-edge);
  const Vector3d way =
      b.cam_from_world.TargetOriginInSource() - a.cam_from_world.TargetOriginInSource();
  if (way.norm() > 0) not_below.push_back(way.normalized());
  for (size_t i = 0; i < not_below.size(); ++i) {
    for (size_t j = i + 1; j < not_below.size(); ++j) {
      const Vector3d edge = not_below[i].cross(not_below[j]);
      if (!(edge.norm() > kRounding)) continue;
      for (const Vector3d& normal : {Vector3d(edge.normalized()), Vector3d(-edge.normalized())}) {
        const bool separates =
            std::all_of(not_below.begin(), not_below.end(),
                        [&](const Vector3d& v) { return normal.dot(v) >= -kRounding; });
        if (separates) return true;
      }
    }
  }
  return false;
}

ImagePairs PairsThatMayOverlap(std::span<const PosedImage> images) {
  ImagePairs pairs;
  for (size_t a = 0; a < images.size(); ++a) {
    for (size_t b = a + 1; b < images.size(); ++b) {
      if (!CannotOverlap(images[a], images[b])) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

}  // namespace dtr::sfm
