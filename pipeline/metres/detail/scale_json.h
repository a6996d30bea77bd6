// pipeline/metres/detail/scale_json.h -- what the scale of a set came from, as JSON.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "pipeline/metres/scale.h"

namespace dtr::pipeline {

/// As a set's provenance has it in `scale`: metres_per_unit, relative_sigma, and ScaleMethodJson.
nlohmann::ordered_json ScaleJson(const ScaleReport& report);
/// `method` and its fields.
nlohmann::ordered_json ScaleMethodJson(const ScaleReport& report);

}  // namespace dtr::pipeline
