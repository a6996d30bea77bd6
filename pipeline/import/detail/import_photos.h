// pipeline/import/detail/import_photos.h -- the photos of a camera list, as structure from motion
// takes them.
#pragma once
#include "capture/photo.h"
#include "pipeline/import/detail/import_views.h"

namespace dtr::pipeline {

/// One photo per camera, in the list's order, with the pixels that its camera describes. Throws
/// Error for a photo that is not of its camera's size.
capture::Capture PhotosOf(const io::CameraList& list, const ImportOptions& options);

}  // namespace dtr::pipeline
