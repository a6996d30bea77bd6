// dtr/simd/coarse_strip.h -- SPEC 5.1 for some rows of an image, with the processor's vector
// instructions. Only dtr/simd's own .cpp files include this.
#pragma once
#include <vector>

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/grid_placement.h"

namespace dtr::simd {

/// A vertex on the novel screen.
struct ScreenPoint {
  float x = 0, y = 0;       ///< pixels
  float inverse_depth = 0;  ///< of the novel camera; 0: not in front of the near plane
};

/// Rows [first, last] of the image.
struct CoarseStrip {
  float* pixels;  ///< inverse depth; of the first row
  int width, first, last;
};

void ProjectVertices(const AdaptiveMesh& mesh, const GridPlacement& placement,
                     std::vector<ScreenPoint>& points);

/// Keeps the nearer of the mesh and what is there. `points`: its vertices. A strip's pixels do not
/// depend on where it begins and ends.
void DrawIntoStrip(const AdaptiveMesh& mesh, const GridPlacement& placement,
                   const std::vector<ScreenPoint>& points, const CoarseStrip& strip);

}  // namespace dtr::simd
