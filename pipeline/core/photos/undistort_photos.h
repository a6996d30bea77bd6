// pipeline/core/photos/undistort_photos.h -- photos become the images of views.
#pragma once
#include <vector>

#include "capture/photo.h"
#include "dtr/base/part.h"
#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/core/calibrate.h"

namespace dtr::pipeline {

struct UndistortOptions {
  int max_size_px = 0;   ///< long side of the images; 0: full size
  double memory_gb = 0;  ///< GB of 1e9 bytes for all that the program holds; 0: no bound
};

/// Views of the registered photos, in the photos' order, on the grid that calib::Undistort gives
/// them; their pixels are written and not kept. A photo whose view an earlier,
/// interrupted run wrote is not read again. `held_out`: for each photo; `part`: of the views: the
/// others are not written, and have no files. Throws Error for a photo that is not of its camera's
/// size.
std::vector<View> UndistortPhotos(const capture::Capture& capture,
                                  const CalibratedPhotos& calibrated,
                                  const std::vector<bool>& held_out,
                                  const UndistortOptions& options, io::SetWriter& writer,
                                  Progress& progress, const Part& part = {});

}  // namespace dtr::pipeline
