// pipeline/core/model_grid.h -- which pixels of photos with an EXIF orientation a model describes.
#pragma once
#include <filesystem>
#include <string>

#include "capture/photo.h"
#include "dtr/base/progress.h"
#include "dtr/types/photo_grid.h"

namespace dtr::pipeline {

/// Of a COLMAP model's cameras, where their size does not say: COLMAP takes photos as they are
/// stored, `dtr calibrate photos` turns them upright and marks its models so.
PhotoGrid GridOfModel(const std::filesystem::path& model_folder);

/// Marks a model as one of upright photos.
void MarkUpright(const std::filesystem::path& model_folder);

/// Settles which pixels `poses` (a file or folder of cameras) describe of photos with an EXIF
/// orientation: by the size of their cameras, else by the program that wrote them. Photos that are
/// meant as stored become so (capture::TakeAsStored); one line says of how many.
/// `format`: of `poses`, empty: by its content.
void TakePhotosAsCamerasDo(const std::filesystem::path& poses, const std::string& format,
                           capture::Capture& photos, Progress& progress);

}  // namespace dtr::pipeline
