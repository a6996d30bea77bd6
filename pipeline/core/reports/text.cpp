#include "pipeline/core/reports/text.h"

#include <nlohmann/json.hpp>

namespace dtr::pipeline {

std::string Text(const nlohmann::ordered_json& json) {
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace dtr::pipeline
