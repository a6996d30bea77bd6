// pipeline/core/cameras/foreign_cameras.h -- cameras of another program for photos that are here.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/sfm_model.h"
#include "dtr/io/formats/foreign_scene.h"
#include "dtr/io/formats/sized_image.h"
#include "pipeline/core/cameras/photo_names.h"

namespace dtr::pipeline {

/// Cameras by the names of their photos.
struct PlacedCameras {
  io::CameraList list;
  /// Cameras, images and points where the file says which photos show them; images are named as in
  /// `list` and their poses are equal.
  std::optional<calib::SfmModel> model;
  /// Entries whose photo is not here, as the file writes it, and where it was looked for.
  std::vector<std::pair<std::string, std::string>> missing;
  std::vector<std::pair<std::string, std::string>> left_out;  ///< as ForeignScene has
  std::vector<std::string> notes;
};

/// Finds the photo of every camera, and its intrinsics on the photo's pixels. `sized` gives a photo
/// by its name, before its EXIF orientation. Throws Error "source: entry (path): ..." where several
/// photos could be meant or one is meant twice, a photo has another shape than its camera, or
/// lengths cannot be those of an image in pixels.
PlacedCameras PlaceCameras(io::ForeignScene scene, const std::string& source,
                           const PhotoNames& photos,
                           const std::function<io::SizedImage(const std::string&)>& sized);

/// The same without photos, for the poses alone: names are the file's own. Throws Error where the
/// file does not say the size of the images.
io::CameraList CamerasWithoutPhotos(const io::ForeignScene& scene, const std::string& source);

/// One line about `left_out`; empty where there is none.
std::string LeftOutLine(const std::string& source,
                        const std::vector<std::pair<std::string, std::string>>& left_out,
                        size_t cameras);

}  // namespace dtr::pipeline
