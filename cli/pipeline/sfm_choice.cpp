#include "cli/pipeline/sfm_choice.h"

#include <nlohmann/json.hpp>

namespace dtr::pipeline {

std::string ToJson(const SfmChoice& choice) {
  const nlohmann::ordered_json json{{"feature_size_px", choice.feature_size_px},
                                    {"features", choice.features},
                                    {"matching", colmap::NameOf(choice.matching)},
                                    {"lens_model", choice.lens_model}};
  return json.dump();
}

}  // namespace dtr::pipeline
