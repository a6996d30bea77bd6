// dtr/gl/coarse_surface.h -- SPEC 5.1: a view's surface with as few primitives as its depth allows.
#pragma once
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/triangulation.h"
#include "dtr/types/view.h"

namespace dtr::gl {

/// Flat parts as large blocks, the rest sample by sample; together they cover what the full
/// triangulation covers, up to the tolerance.
struct CoarseSurface {
  std::vector<float> blocks;  ///< 7 each: depth-grid position of A (pixels), side, 1/z of A B C D
  std::vector<float> splats;  ///< 5 each, as MakeSplats
};

/// A block of 8x8 or 4x4 samples is one primitive where all its samples lie within `tolerance`
/// (a difference of 1/z) of the surface between its corners.
CoarseSurface MakeCoarseSurface(const SampleGrid& samples, const BreakRule& rule, double tolerance);

}  // namespace dtr::gl
