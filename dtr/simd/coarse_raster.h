// dtr/simd/coarse_raster.h -- SPEC 5.1. Only dtr/simd's own .cpp files and its tests include this.
#pragma once
#include <vector>

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/frame.h"
#include "dtr/render/grid_placement.h"
#include "dtr/simd/coarse_strip.h"

namespace dtr::simd {

/// A mesh and where it lies on the novel screen.
struct PlacedMesh {
  const AdaptiveMesh* mesh = nullptr;
  GridPlacement placement;
};

/// The same surface as coarse_triangles.comp and coarse_cells.comp of dtr/gl draw, up to single
/// precision. Keeps its buffers from frame to frame.
class CoarseRaster {
 public:
  /// The nearest surface of all meshes in the band's pixels; `threads` as ParallelFor, the result
  /// does not depend on it.
  void Draw(const std::vector<PlacedMesh>& meshes, int width_px, const Band& band);

  /// Inverse depth in the novel camera, 0 where nothing is; the band's first row first.
  const std::vector<float>& nearest() const { return nearest_; }

 private:
  std::vector<std::vector<ScreenPoint>> points_;  ///< of the meshes
  std::vector<float> nearest_;
};

}  // namespace dtr::simd
