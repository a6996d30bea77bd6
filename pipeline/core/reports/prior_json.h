// pipeline/core/reports/prior_json.h -- depth priors in records. Internal: JSON objects.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "pipeline/core/depth_prior.h"

namespace dtr::pipeline {

/// What of the choice decides the depth, but for the maps themselves; null without a prior.
nlohmann::ordered_json PriorJson(const DepthPriorChoice& choice);
/// The object whose text ToJson gives.
nlohmann::ordered_json JsonOf(const DepthPriorReport& report);

}  // namespace dtr::pipeline
