// dtr/io/formats/plausible_intrinsics.h -- numbers that no camera has, whichever file they come
// from.
#pragma once
#include <string>

namespace dtr::io {

/// Throws Error "where: ..." for focal lengths (px) that no lens of an image of this size has:
/// below 0.02 of its long side (175 degrees without distortion) or above 1000 of it (3 arc
/// minutes). They are of another unit or of another image.
void RequirePlausibleFocal(double fx_px, double fy_px, int width_px, int height_px,
                           const std::string& where);

/// The same for a principal point (px) farther from the middle of the image than its size.
void RequirePlausibleCentre(double cx_px, double cy_px, int width_px, int height_px,
                            const std::string& where);

}  // namespace dtr::io
