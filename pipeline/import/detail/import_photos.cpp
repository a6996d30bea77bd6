#include "pipeline/import/detail/import_photos.h"

#include <fmt/format.h>

#include "dtr/base/error.h"
#include "dtr/io/image_io.h"

namespace dtr::pipeline {
namespace {

capture::Photo PhotoOf(const io::NamedCamera& named, const ImportOptions& options) {
  capture::Photo photo;
  photo.name = named.name;
  photo.file = options.images_dir / named.name;
  const io::ImageHeader header = io::ReadImageHeader(photo.file);
  photo.width_px = named.camera.width_px();
  photo.height_px = named.camera.height_px();
  photo.exif_orientation = header.exif_orientation;
  const auto grid =
      GridOfSize(photo.width_px, photo.height_px,
                 {header.width_px, header.height_px, header.exif_orientation}, options.photo_grid);
  if (!grid) {
    throw Error(fmt::format(
        "{}: expected {}x{} pixels as the camera says, found {}x{}; give the "
        "images the cameras were made for",
        photo.file.string(), photo.width_px, photo.height_px, header.width_px, header.height_px));
  }
  photo.as_stored = *grid == PhotoGrid::kStored;
  // The mask of a rotated or mirrored photo is of the camera's pixels here, upright in a capture.
  if (!named.mask_file.empty() && photo.exif_orientation == 1) {
    photo.mask_file = MaskFolder(options) / named.mask_file;
  }
  return photo;
}

}  // namespace

capture::Capture PhotosOf(const io::CameraList& list, const ImportOptions& options) {
  capture::Capture photos;
  for (const io::NamedCamera& named : list.cameras) {
    photos.photos.push_back(PhotoOf(named, options));
  }
  return photos;
}

}  // namespace dtr::pipeline
