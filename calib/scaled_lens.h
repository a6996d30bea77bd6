// calib/scaled_lens.h -- a lens on images that were scaled.
#pragma once
#include "calib/lens_camera.h"

namespace dtr::calib {

/// The same lens on the image scaled to another size, by axis: with two focal lengths where the
/// axes are not scaled alike.
LensCamera ScaledTo(LensCamera camera, int width_px, int height_px);

}  // namespace dtr::calib
