// dtr/render/fill_holes.h -- SPEC 7: colour and depth for what no view saw, apart from rendering.
#pragma once
#include "dtr/render/result.h"
#include "dtr/types/grid.h"

namespace dtr {

/// Plane z of what was seen; 0 at holes.
Grid<float> SeenDepth(const RenderResult& result);

/// Fills the image where coverage is 0, from its surroundings. Depth, coverage, view counts and
/// coverage_share stay as they are: what is filled never counts as seen. Work is linear in the
/// pixels; the result does not depend on `threads` (0: as ParallelFor). An image without any
/// covered pixel stays black.
/// Returns where what the image shows now lies, for hosts that hide other things by it: plane z,
/// seen or filled; 0 where it is still empty.
Grid<float> FillHoles(RenderResult& result);

}  // namespace dtr
