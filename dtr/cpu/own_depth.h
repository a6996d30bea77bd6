// dtr/cpu/own_depth.h -- SPEC 5: each view's fragments on its own depth map.
#pragma once
#include <span>
#include <vector>

#include "dtr/cpu/layer.h"
#include "dtr/render/blend_weights.h"

namespace dtr::cpu {

/// SPEC 5.1: the nearest surface of all views at each pixel of their band, 1/z; 0: none. All layers
/// are of one band; there is at least one.
std::vector<double> NearestSurface(std::span<const Layer> layers);

/// SPEC 5.2: replaces each pixel's surface (1/z, row-major; 0: none) with what the views hold
/// together, where their patches have it; where they reject it with the next one behind, or none.
/// Does not depend on the number of threads.
void KeepSupportedSurfaces(std::span<const ViewInNovel> views, const PinholeCamera& novel,
                           const RenderOptions& options, const BlendParameters& blend,
                           const Band& band, std::span<double> surfaces);

/// SPEC 5.3: the view's own fragments at the pixels of `band`, found on its depth map from the
/// surfaces that are held (1/z per pixel of the band, row-major; 0: nothing there).
Layer FindOwnFragments(const ViewInNovel& view_in_novel, const PinholeCamera& novel,
                       const RenderOptions& options, const Band& band,
                       std::span<const double> surfaces);

}  // namespace dtr::cpu
