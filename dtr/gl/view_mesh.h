// dtr/gl/view_mesh.h -- what is drawn of a view, as lists for the GPU; made on the CPU, once.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/types/view.h"

namespace dtr::gl {

/// SPEC 2: the implied triangulation with its closed cells. The samples come first, row by row
/// (also those that do not exist: indices leave them out), then the corners of closed cells.
struct ViewMesh {
  std::vector<float> points;           ///< 3 each: depth-grid position (pixels), 1/z
  std::vector<std::uint32_t> indices;  ///< 3 each, clockwise on the view's screen (y down)
};
ViewMesh MakeViewMesh(const View& view, const RenderOptions& options);

/// SPEC 3: 5 each: depth-grid position (pixels), 1/z, its slopes along x and y per sample.
std::vector<float> MakeSplats(const View& view, const RenderOptions& options);

}  // namespace dtr::gl
