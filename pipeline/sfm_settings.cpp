#include "pipeline/sfm_settings.h"

#include <nlohmann/json.hpp>

namespace dtr::pipeline {

const char* NameOf(CameraPer per) {
  switch (per) {
    case CameraPer::kAuto:
      return "auto";
    case CameraPer::kFolder:
      return "folder";
    case CameraPer::kPhoto:
      return "photo";
    case CameraPer::kSet:
      return "set";
  }
  return "";
}

std::string ToJson(const SfmChoice& choice) {
  nlohmann::ordered_json json{{"feature_size_px", choice.feature_size_px},
                              {"features", choice.features},
                              {"matching", colmap::NameOf(choice.matching)},
                              {"lens_model", choice.lens_model}};
  // Builds that were begun before there was a choice go on.
  if (choice.camera_per != CameraPer::kAuto) json["camera_per"] = NameOf(choice.camera_per);
  return json.dump();
}

}  // namespace dtr::pipeline
