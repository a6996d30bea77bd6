#include "dtr/io/formats/sized_image.h"

#include <cmath>

#include "dtr/base/error.h"

namespace dtr::io {

PinholeCamera ScaledToImage(const PinholeCamera& full_size, const SizedImage& image,
                            const std::string& what) {
  constexpr double kAspectTolerance = 0.01;
  if (image.width_px < 1 || image.height_px < 1) {
    throw Error(what + ": expected an image with pixels, found an empty one");
  }
  const double ratio = (double(image.width_px) / full_size.width_px()) /
                       (double(image.height_px) / full_size.height_px());
  if (std::abs(ratio - 1) > kAspectTolerance) {
    throw Error(what + ": expected an image of the shape " + std::to_string(full_size.width_px()) +
                "x" + std::to_string(full_size.height_px()) + ", found " +
                std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
                "; give the images the cameras were written for, neither turned nor cropped");
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
