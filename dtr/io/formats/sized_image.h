// dtr/io/formats/sized_image.h -- cameras written for images that have been scaled since.
#pragma once
#include <string>

#include "dtr/types/camera.h"

namespace dtr::io {

/// An image that is there, with the size it has now, before its EXIF orientation.
struct SizedImage {
  std::string name;
  int width_px = 0, height_px = 0;
  int exif_orientation = 1;
};

/// `full_size` scaled per axis to the size of `image`: as it is stored, or turned by its EXIF
/// orientation where only that has the camera's shape. Throws Error starting with `what` when the
/// image is empty or has another shape than the camera (1 % of the aspect ratio is allowed, since
/// scaled images have whole pixels): then it is another image, or was turned or cropped.
PinholeCamera ScaledToImage(const PinholeCamera& full_size, const SizedImage& image,
                            const std::string& what);

}  // namespace dtr::io
