// dtr/render/fill_holes.h -- SPEC 7: a guess for what no view saw, apart from rendering.
#pragma once
#include "dtr/render/result.h"

namespace dtr {

/// Fills the image where coverage is 0; covered pixels, depth, coverage, view counts and
/// coverage_share stay as they are: a guess is never counted as seen. Push-pull (Gortler et al.,
/// The Lumigraph, 1996) in linear light that takes colours from the background: of the cells around
/// a hole the farthest has the most say, for what a view did not see was hidden by something
/// nearer. Work is linear in the pixels. A picture without any covered pixel stays black.
void FillHoles(RenderResult& result);

}  // namespace dtr
