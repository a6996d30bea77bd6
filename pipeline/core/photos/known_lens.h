// pipeline/core/photos/known_lens.h -- a camera that is known, for the photos at hand.
#pragma once
#include "calib/lens_camera.h"
#include "capture/capture.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// Throws Error unless the camera can be that of all photos, before any work: each must be stored
/// as it was taken, and have the camera's size or have been scaled as a whole; a line says the
/// latter.
void RequireLensOfPhotos(const calib::LensCamera& lens, const capture::Capture& photos,
                         Progress& progress);

}  // namespace dtr::pipeline
