#include "pipeline/core/cameras/names_of_photos.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "calib/colmap/model_io.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/cameras/photo_scale.h"
#include "pipeline/core/model_grid.h"

namespace dtr::pipeline {
namespace {

bool EndsWithPath(const std::string& name, const std::string& end) {
  return name.size() > end.size() && name.ends_with(end) &&
         name[name.size() - end.size() - 1] == '/';
}

// A name that is no photo's becomes that of the one photo which it ends, or which ends it.
void Rename(const capture::Capture& capture, const std::vector<std::string*>& names) {
  std::map<std::string, int> claims;  // by photo
  for (const capture::Photo& photo : capture.photos) claims[photo.name] = 0;
  std::vector<std::pair<std::string*, std::string>> renamed;
  for (std::string* name : names) {
    if (const auto same = claims.find(*name); same != claims.end()) {
      ++same->second;
      continue;
    }
    std::vector<std::string> meant;
    for (const auto& [photo, count] : claims) {
      if (EndsWithPath(photo, *name) || EndsWithPath(*name, photo)) meant.push_back(photo);
    }
    if (meant.size() != 1) continue;
    ++claims[meant.front()];
    renamed.emplace_back(name, meant.front());
  }
  for (const auto& [name, photo] : renamed) {
    if (claims[photo] == 1) *name = photo;
  }
}

}  // namespace

void NameAsPhotos(const capture::Capture& capture, io::CameraList& list) {
  std::vector<std::string*> names;
  for (io::NamedCamera& camera : list.cameras) names.push_back(&camera.name);
  Rename(capture, names);
}

calib::SfmModel ReadModelOf(const capture::Capture& capture, const std::filesystem::path& folder,
                            std::vector<std::string>* notes) {
  calib::SfmModel model = ReadGivenModel(folder, notes);
  std::vector<std::string*> names;
  for (calib::SfmImage& image : model.images) names.push_back(&image.name);
  Rename(capture, names);
  std::sort(model.images.begin(), model.images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  std::map<std::string, StoredSize> sizes;
  for (const capture::Photo& photo : capture.photos) {
    sizes[photo.name] = capture::StoredSizeOf(photo);
  }
  const std::filesystem::path model_folder = colmap::ModelFolderIn(folder);
  const std::string line =
      ScaleToPhotos(sizes, GridOfModel(model_folder), model_folder.string(), model);
  if (notes != nullptr && !line.empty()) notes->push_back(line);
  return model;
}

}  // namespace dtr::pipeline
