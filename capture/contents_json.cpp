#include "capture/contents_json.h"

#include <nlohmann/json.hpp>

namespace dtr::capture {

nlohmann::ordered_json JsonOf(const FolderContents& contents) {
  nlohmann::ordered_json json{
      {"photos", contents.photos},         {"masks", contents.masks},
      {"depth_maps", contents.depth_maps}, {"videos", contents.videos},
      {"cameras", contents.cameras},       {"ignored", nlohmann::ordered_json::array()}};
  for (const Ignored& ignored : contents.ignored) {
    json["ignored"].push_back({{"kind", ignored.kind},
                               {"files", ignored.files},
                               {"where", ignored.where},
                               {"reason", ignored.reason}});
  }
  return json;
}

}  // namespace dtr::capture
