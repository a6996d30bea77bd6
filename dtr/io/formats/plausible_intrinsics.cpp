#include "dtr/io/formats/plausible_intrinsics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"

namespace dtr::io {

void RequirePlausibleFocal(double fx_px, double fy_px, int width_px, int height_px,
                           const std::string& where) {
  constexpr double kMinFocal = 0.02, kMaxFocal = 1000;  // long sides
  const double side = std::max(width_px, height_px);
  for (const double focal_px : {fx_px, fy_px}) {
    if (focal_px >= kMinFocal * side && focal_px <= kMaxFocal * side) continue;
    throw Error(fmt::format(
        "{}: a focal length of {:g} px cannot be that of an image of {} x {} px; the file has "
        "another unit, or belongs to other images",
        where, focal_px, width_px, height_px));
  }
}

void RequirePlausibleCentre(double cx_px, double cy_px, int width_px, int height_px,
                            const std::string& where) {
  if (std::abs(cx_px - width_px / 2.0) <= width_px &&
      std::abs(cy_px - height_px / 2.0) <= height_px) {
    return;
  }
  throw Error(fmt::format(
      "{}: a principal point of ({:g}, {:g}) px cannot be that of an image of {} x {} px; the file "
      "has another unit, or belongs to other images",
      where, cx_px, cy_px, width_px, height_px));
}

}  // namespace dtr::io
