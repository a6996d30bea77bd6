// dtr/types/depth_image.h -- a depth map that says what it measures.
#pragma once
#include <limits>

#include "dtr/types/camera.h"
#include "dtr/types/grid.h"

namespace dtr {

/// One depth per pixel centre, shape (height, width), row-major, top row first. Scene units.
/// A hole is 0; IsHole() also catches NaN and infinity. Never interpolate across holes or
/// silhouettes.
class DepthImage {
 public:
  DepthImage() = default;
  /// All holes. Throws std::invalid_argument unless the sizes are positive.
  DepthImage(int width_px, int height_px, DepthKind kind = DepthKind::kPlaneZ)
      : grid_(width_px, height_px), kind_(kind) {}

  int width() const { return grid_.width(); }
  int height() const { return grid_.height(); }
  bool empty() const { return grid_.empty(); }
  DepthKind kind() const { return kind_; }
  bool Contains(int x, int y) const { return grid_.Contains(x, y); }

  /// Unchecked: requires Contains(x, y).
  float& operator()(int x, int y) { return grid_(x, y); }
  float operator()(int x, int y) const { return grid_(x, y); }
  float* row(int y) { return grid_.row(y); }
  const float* row(int y) const { return grid_.row(y); }
  Grid<float>& grid() { return grid_; }
  const Grid<float>& grid() const { return grid_; }

  static bool IsHole(float depth) {
    return !(depth > 0.0f) || depth > std::numeric_limits<float>::max();
  }

  bool operator==(const DepthImage&) const = default;

 private:
  Grid<float> grid_;
  DepthKind kind_ = DepthKind::kPlaneZ;
};

/// z-depth from any kind: a ray distance is multiplied by the cosine between the pixel's ray and
/// the optical axis. `camera` must have the size of the map. Holes stay holes.
DepthImage ToPlaneZ(const DepthImage& depth, const PinholeCamera& camera);

}  // namespace dtr
