// dtr/render/block_cover.h -- which rectangles of a view's samples are flat enough to be drawn as
// two triangles.
#pragma once
#include "dtr/render/triangulation.h"
#include "dtr/types/block_cover.h"

namespace dtr {

/// A rectangle is chosen where all its samples lie within `tolerance` (a difference of 1/z) of its
/// own two triangles: aligned squares first, whose corners meet, then the largest that fit beside
/// depth breaks. Blocks beside a break that only small rectangles would hold are left to the cells
/// of their samples. `threads` as ParallelFor; the result does not depend on it.
BlockCover CoverBlocks(const Grid<double>& inverse_depth, const BreakRule& rule, double tolerance);

/// SPEC 2.2's choice for a rectangle with these corners: true when it is split along B-C.
bool SplitsAlongBC(double a, double b, double c, double d);

}  // namespace dtr
