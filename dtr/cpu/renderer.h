// dtr/cpu/renderer.h -- the reference renderer: the meaning of docs/RENDER_SPEC.md.
#pragma once
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::cpu {

/// Renders the scene as seen by `novel` at `novel_from_world` (the world of the scene's views),
/// in double precision, by the two-pass method of Verlani et al. 2006 or by the deferred one, as
/// RENDER_SPEC states them.
/// The result does not depend on the order of the views or on the number of threads. Where no view
/// is valid the image is empty: black, no depth, no coverage.
/// With options.fill_holes, FillHoles is applied to the finished image.
/// Throws dtr::UsageError for options without a meaning and for images beyond 2^28 pixels, and
/// dtr::Error for a pose that is not finite.
RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                    const Pose& novel_from_world, const RenderOptions& options);

}  // namespace dtr::cpu
