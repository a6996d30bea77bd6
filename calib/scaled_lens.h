// calib/scaled_lens.h -- a lens on images that were scaled as a whole.
#pragma once
#include <optional>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// The same lens on the image scaled to another size, by axis: with two focal lengths where the
/// axes are not scaled alike.
LensCamera ScaledTo(LensCamera camera, int width_px, int height_px);

/// The camera for photos of this size; its own size: the camera itself. Empty where the aspect
/// ratio is another, by more than rounding to whole pixels: photos that were cropped have their
/// principal point elsewhere. One focal length stays one, scaled by the axes' geometric mean.
std::optional<LensCamera> ScaledLens(const LensCamera& lens, int width_px, int height_px);

}  // namespace dtr::calib
