// pipeline/import/detail/camera_files.h -- known cameras, whichever program wrote them.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_confidence.h"

namespace dtr {
class TemporaryFolder;
}

namespace dtr::pipeline {

/// Cameras with what else their file brings.
struct CamerasFromFile {
  io::CameraList list = {};
  /// Images named and posed as in `list`, with points, where the file says which photos show them;
  /// images in order of their names.
  std::optional<calib::SfmModel> model = {};
  /// Where masks that the file names lie; empty: `masks` beside the images.
  std::filesystem::path mask_dir = {};
  /// Where images and depth maps of a capture lie; empty: the request says.
  std::filesystem::path images_dir = {}, depth_dir = {};
  io::ConfidenceMaps confidence = {};  ///< of the maps in depth_dir
  /// What these lie in where the capture is an archive: they last no longer than it.
  std::shared_ptr<const TemporaryFolder> unpacked = {};
  /// Photos that the file says are for measuring; empty: it says nothing of that.
  std::optional<std::set<std::string>> held_out = {};
  std::optional<double> depth_unit = {};  ///< of depth maps that the file names
  std::string points_file = {};           ///< points of which no photo is known to see which
  /// Cameras without a photo, and why they are left out.
  std::vector<std::pair<std::string, std::string>> skipped = {};
  std::vector<std::string> notes = {};  ///< one line each
};

/// Where files that a camera file names lie.
struct CameraFileFolders {
  std::filesystem::path images, depth;
  std::filesystem::path masks;  ///< empty: where the file's names of masks lead, of images or file
  bool allow_missing = false;   ///< cameras without a photo are left out
};

/// Reads cameras of images, which may have distortion. `format`: as of FormatOf
/// (pipeline/core/cameras/camera_formats.h), "" goes by the content. `folders.images` gives the
/// images' names and sizes to the formats that do not store them. Throws UsageError where the
/// format cannot be recognised, Error where the file is broken or, without `allow_missing`, a photo
/// is not there.
CamerasFromFile ReadCameraFile(const std::filesystem::path& file, const std::string& format,
                               const CameraFileFolders& folders);

/// Images that lie beside the photos of the list and are no file of it: neither photo nor depth map
/// nor mask. In byte order, relative to `images_dir`.
std::vector<std::string> PhotosWithoutCamera(const io::CameraList& list,
                                             const std::filesystem::path& images_dir);

/// Finds masks for the cameras of a file that names none (COLMAP's, LLFF's): for a photo
/// left/a.jpg the first of left/a_mask.png, left/a.jpg.png (COLMAP's name) and left/a.png, with any
/// extension of an image, that lies in `mask_dir` and is not the photo itself, in `images_dir`;
/// photos without one stay without. Throws UsageError where the folder is none or holds no mask of
/// any of them.
void NameMasks(const std::filesystem::path& mask_dir, const std::filesystem::path& images_dir,
               io::CameraList& list);

/// Names of `list` that a --holdout text means (pipeline/core/photos/holdout.h), over its cameras
/// in byte order of their names.
std::set<std::string> NamesHeldOut(const std::string& spec, const io::CameraList& list);

}  // namespace dtr::pipeline
