#include "pipeline/core/photos/known_lens.h"

#include <fmt/format.h>

#include "pipeline/core/camera_file.h"

namespace dtr::pipeline {

void RequireLensOfPhotos(const calib::LensCamera& lens, const capture::Capture& photos,
                         Progress& progress) {
  const capture::Photo* scaled = nullptr;
  for (const capture::Photo& photo : photos.photos) {
    (void)LensFor(lens, photo.width_px, photo.height_px, photo.name);
    const bool same = photo.width_px == lens.width_px && photo.height_px == lens.height_px;
    if (!same && scaled == nullptr) scaled = &photo;
  }
  if (scaled == nullptr) return;
  progress.Note(fmt::format(
      "`lens`: intrinsics of {} x {} px are scaled to {} x {} px, the size of {}", lens.width_px,
      lens.height_px, scaled->width_px, scaled->height_px, scaled->name));
}

}  // namespace dtr::pipeline
