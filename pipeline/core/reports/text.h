// pipeline/core/reports/text.h -- reports as the text that commands print.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace dtr::pipeline {

/// With one space a level. Names come from files: bytes that are no UTF-8 are replaced, so that
/// they do not make the whole report unreadable.
std::string Text(const nlohmann::ordered_json& json);

}  // namespace dtr::pipeline
