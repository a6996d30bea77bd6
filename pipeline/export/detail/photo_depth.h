// pipeline/export/detail/photo_depth.h -- depth on the grid of the original photo.
#pragma once
#include "calib/lens_camera.h"
#include "pipeline/export/detail/depth_file.h"

namespace dtr::pipeline {

/// Depth of a view at the pixel centres of the photo that `lens` took: where the lens' ray of a
/// pixel meets the view's surface, interpolated within one surface only. Ray distance is along the
/// lens' ray, z that of the view's camera, which is the same direction. Holes where the lens has no
/// ray, or one that the set's image does not show. `threads` as ParallelFor.
DepthPlanes PlanesOnPhoto(const SurfaceView& surface, const calib::LensCamera& lens,
                          DepthKind kind);

}  // namespace dtr::pipeline
