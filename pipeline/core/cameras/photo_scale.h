// pipeline/core/cameras/photo_scale.h -- a model whose photos were scaled since it was made.
#pragma once
#include <map>
#include <string>

#include "calib/sfm_model.h"
#include "dtr/types/photo_grid.h"

namespace dtr::pipeline {

/// Puts cameras and features of a model on the pixels of photos that are scaled copies of its own
/// images (images_2, images_4): same aspect but for the rounding to whole pixels, on one of the
/// photo's grids, `convention` first. Others stay as they are, as does a size that is nearly the
/// camera's: such a photo was cropped or undistorted. `sizes`: of photos by name. Returns one line
/// about what was scaled, "" where nothing was. `source`: of the model.
std::string ScaleToPhotos(const std::map<std::string, StoredSize>& sizes, PhotoGrid convention,
                          const std::string& source, calib::SfmModel& model);

}  // namespace dtr::pipeline
