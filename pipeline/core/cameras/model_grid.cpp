#include "pipeline/core/model_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

#include "dtr/base/files.h"
#include "pipeline/core/cameras/known_poses.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr char kMark[] = "upright_photos.txt";

// The size of each photo's camera, and the convention of the file.
struct CameraSizes {
  std::map<std::string, std::pair<int, int>> by_name;
  PhotoGrid convention = PhotoGrid::kStored;
};

CameraSizes SizesOf(const fs::path& poses, const std::string& format,
                    const capture::Capture& photos) {
  CameraSizes sizes;
  const PosesFile file = ReadPoses(photos, poses, format);
  for (const io::NamedCamera& named : file.list.cameras) {
    sizes.by_name[named.name] = {named.camera.width_px(), named.camera.height_px()};
  }
  if (file.list.cameras.empty() && file.model) {
    for (const calib::SfmImage& image : file.model->images) {
      const calib::LensCamera& camera = file.model->cameras.at(image.camera_id);
      sizes.by_name[image.name] = {camera.width_px, camera.height_px};
    }
  }
  sizes.convention = file.list.photo_grid;
  return sizes;
}

}  // namespace

PhotoGrid GridOfModel(const fs::path& model_folder) {
  return fs::exists(model_folder / kMark) ? PhotoGrid::kUpright : PhotoGrid::kStored;
}

void MarkUpright(const fs::path& model_folder) {
  WriteFileAtomically(model_folder / kMark,
                      "The cameras of this model are of photos rotated upright by their EXIF "
                      "orientation.\n");
}

void TakePhotosAsCamerasDo(const fs::path& poses, const std::string& format,
                           capture::Capture& photos, Progress& progress) {
  const bool any = std::any_of(photos.photos.begin(), photos.photos.end(),
                               [](const auto& photo) { return photo.exif_orientation != 1; });
  if (!any) return;
  const CameraSizes sizes = SizesOf(poses, format, photos);
  std::string first_stored, first_turned;
  int stored = 0, turned = 0;
  for (capture::Photo& photo : photos.photos) {
    const auto camera = sizes.by_name.find(photo.name);
    if (photo.exif_orientation == 1 || camera == sizes.by_name.end()) continue;
    const auto grid = GridOfSize(camera->second.first, camera->second.second,
                                 capture::StoredSizeOf(photo), sizes.convention);
    if (!grid) continue;  // rejected by its size when it is read
    if (*grid == PhotoGrid::kUpright) {
      if (turned++ == 0) first_turned = photo.name;
    } else {
      if (stored++ == 0) first_stored = photo.name;
      capture::TakeAsStored(photo);
    }
  }
  if (stored > 0) {
    progress.Note(
        fmt::format("{} photos with an EXIF orientation, first {}: taken as they are "
                    "stored, as their cameras describe them",
                    stored, first_stored));
  }
  if (turned > 0) {
    progress.Note(fmt::format(
        "{} photos, first {}: rotated by their EXIF orientation, as their cameras describe them",
        turned, first_turned));
  }
}

}  // namespace dtr::pipeline
