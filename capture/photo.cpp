#include "capture/photo.h"

#include "dtr/base/error.h"

namespace dtr::capture {

void RequireEnoughPhotos(const Capture& capture, const std::filesystem::path& where) {
  if (capture.photos.size() >= 2) return;
  std::string message = where.string() + ": expected at least 2 photos, found " +
                        std::to_string(capture.photos.size());
  if (!capture.skipped.empty()) {
    message += " and " + std::to_string(capture.skipped.size()) + " skipped (" +
               capture.skipped.front().name + ": " + capture.skipped.front().reason + ")";
  }
  throw Error(message + "; a scene needs several views");
}

ImageRgb8 ReadPhoto(const Photo& photo) {
  ImageRgb8 image = io::ReadImage(photo.file, {.apply_exif_orientation = true});
  if (image.width() != photo.width_px || image.height() != photo.height_px) {
    throw Error(photo.file.string() + ": expected a photo of " + std::to_string(photo.width_px) +
                "x" + std::to_string(photo.height_px) + " pixels as when it was ingested, found " +
                std::to_string(image.width()) + "x" + std::to_string(image.height()) +
                "; ingest the photos again");
  }
  return image;
}

}  // namespace dtr::capture
