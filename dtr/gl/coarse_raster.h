// dtr/gl/coarse_raster.h -- SPEC 5.1 on the CPU, for drivers that draw on the CPU themselves. Only
// dtr/gl's own .cpp files and its tests include this.
#pragma once
#include <vector>

#include "dtr/gl/coarse_strip.h"
#include "dtr/gl/frame.h"
#include "dtr/gl/grid_placement.h"
#include "dtr/render/adaptive_mesh.h"

namespace dtr::gl {

/// A mesh and where it lies on the novel screen.
struct PlacedMesh {
  const AdaptiveMesh* mesh = nullptr;
  GridPlacement placement;
};

/// The same surface as coarse_triangles.comp and coarse_cells.comp draw, up to single precision.
/// Software rasterisers emulate a shader's scattered writes one by one, each an atomic operation;
/// plain C++ takes a fourth of their CPU time (docs/accuracy/SPEED.md). Keeps its buffers from
/// frame to frame.
class CoarseRaster {
 public:
  /// The nearest surface of all meshes in the band's pixels; `threads` as ParallelFor, the result
  /// does not depend on it.
  void Draw(const std::vector<PlacedMesh>& meshes, int width_px, const Band& band, int threads);

  /// Inverse depth in the novel camera, 0 where nothing is; the band's first row first.
  const std::vector<float>& nearest() const { return nearest_; }

 private:
  std::vector<std::vector<ScreenPoint>> points_;  ///< of the meshes
  std::vector<float> nearest_;
};

}  // namespace dtr::gl
