#include "pipeline/metres/detail/panorama_positions.h"

#include <map>

#include "capture/ingest.h"

namespace dtr::pipeline {

namespace fs = std::filesystem;

PhotoPositions ReadPanoramaPositions(const fs::path& folder, const std::vector<std::string>& views,
                                     Progress& progress) {
  capture::Capture panoramas =
      capture::IngestPhotos(folder, {.recurse = true, .screen = false}, progress);
  std::map<std::string, std::string> view_of;  // the first one, by the panorama's id
  for (const std::string& view : views) view_of.emplace(fs::path(view).stem().string(), view);
  std::vector<std::string> names;
  for (capture::Photo& photo : panoramas.photos) {
    const auto view = view_of.find(photo.id);
    if (view == view_of.end()) continue;
    photo.name = view->second;
    names.push_back(photo.name);
  }
  return PhotoPositionsOf(panoramas, names);
}

}  // namespace dtr::pipeline
