#include "dtr/io/formats/sized_image.h"

#include <cmath>

#include "dtr/base/error.h"
#include "dtr/types/photo_grid.h"

namespace dtr::io {

namespace {

// Scaled images have whole pixels: their shape differs a little from that of the full size.
bool HasShape(int width_px, int height_px, const PinholeCamera& camera) {
  constexpr double kAspectTolerance = 0.01;
  const double ratio =
      (double(width_px) / camera.width_px()) / (double(height_px) / camera.height_px());
  return std::abs(ratio - 1) <= kAspectTolerance;
}

}  // namespace

PinholeCamera ScaledToImage(const PinholeCamera& full_size, const SizedImage& stored,
                            const std::string& what) {
  if (stored.width_px < 1 || stored.height_px < 1) {
    throw Error(what + ": expected an image with pixels, found an empty one");
  }
  const StoredSize size{stored.width_px, stored.height_px, stored.exif_orientation};
  SizedImage image = stored;
  if (!HasShape(image.width_px, image.height_px, full_size)) {
    image.width_px = size.WidthOn(PhotoGrid::kUpright);
    image.height_px = size.HeightOn(PhotoGrid::kUpright);
  }
  if (!HasShape(image.width_px, image.height_px, full_size)) {
    throw Error(what + ": expected an image of the shape " + std::to_string(full_size.width_px()) +
                "x" + std::to_string(full_size.height_px()) + ", found " +
                std::to_string(stored.width_px) + "x" + std::to_string(stored.height_px) +
                "; give the images the cameras were written for, neither rotated nor cropped");
  }
  const double sx = static_cast<double>(image.width_px) / full_size.width_px();
  const double sy = static_cast<double>(image.height_px) / full_size.height_px();
  for (const double scaled_px : {sx * full_size.fx_px(), sy * full_size.fy_px(),
                                 sx * full_size.cx_px(), sy * full_size.cy_px()}) {
    if (std::isfinite(scaled_px)) continue;
    throw Error(what + ": expected focal lengths and a principal point that are finite at " +
                std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
                ", found ones beyond all numbers");
  }
  if (!(sx * full_size.fx_px() > 0) || !(sy * full_size.fy_px() > 0)) {
    throw Error(what + ": expected focal lengths above 0 at " + std::to_string(image.width_px) +
                "x" + std::to_string(image.height_px) + ", found ones that vanish");
  }
  return full_size.Resized(image.width_px, image.height_px);
}

}  // namespace dtr::io
