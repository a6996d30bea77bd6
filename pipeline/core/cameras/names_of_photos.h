// pipeline/core/cameras/names_of_photos.h -- cameras of another program by the names that our
// photos have.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "capture/capture.h"
#include "dtr/io/formats/cameras_json.h"

namespace dtr::pipeline {

/// Programs name photos below another folder than ours, as COLMAP does below images/ of a project:
/// names that end as those of photos do become these where that is one to one. Others stay.
void NameAsPhotos(const capture::Capture& capture, io::CameraList& list);

/// The COLMAP model in `folder` (ModelFolderIn), its images in byte order of such names, its
/// cameras on the pixels of the photos (ScaleToPhotos). Throws Error as colmap::ReadModel does.
/// `notes` gets what reading and scaling say.
calib::SfmModel ReadModelOf(const capture::Capture& capture, const std::filesystem::path& folder,
                            std::vector<std::string>* notes = nullptr);

}  // namespace dtr::pipeline
