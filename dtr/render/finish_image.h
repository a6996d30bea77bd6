// dtr/render/finish_image.h -- SPEC 7 and 8: what is done to a rendered image after its pixels are
// drawn.
#pragma once
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr {

/// True where FinishImage changes anything.
inline bool NeedsFinishing(const RenderOptions& options) {
  return options.fill_holes || options.smooth_edges;
}

/// Fills holes and smooths edges, as `options` say, of an image that a renderer drew of `scene`
/// without either; `result.views_used` are indices into the scene. Only the image changes: what is
/// filled never counts as seen. Returns where what the image shows now lies, for hosts that hide
/// other things by it: plane z in scene units, seen or filled; 0 where nothing is shown.
Grid<float> FinishImage(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result);

}  // namespace dtr
