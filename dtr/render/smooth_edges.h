// dtr/render/smooth_edges.h -- SPEC 8: rendered images without stairs at depth edges.
#pragma once
#include <Eigen/Core>
#include <span>

#include "dtr/render/result.h"
#include "dtr/types/camera.h"

namespace dtr {

/// SPEC 8. Mixes pixels at depth edges with the 3 x 3 pixels around, in linear light: fully on a
/// clear edge, less on a slight one, and not where the pixel of a photo is shown as it is, which
/// has its edges from the camera. Only the image changes. Holes (coverage 0) take part as the
/// surface behind everything where `holes_are_filled`, else neither they nor their colours are
/// touched. `view_centres`: of the views in use, in the novel camera's frame, scene units.
/// The result does not depend on `threads` (0: as ParallelFor).
void SmoothEdges(const PinholeCamera& novel, std::span<const Eigen::Vector3d> view_centres,
                 bool holes_are_filled, RenderResult& result);

}  // namespace dtr
