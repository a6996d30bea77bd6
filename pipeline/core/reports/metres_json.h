// pipeline/core/reports/metres_json.h -- what metres came from, as JSON.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "pipeline/core/metres.h"

namespace dtr::pipeline {

/// What can change a result.
nlohmann::ordered_json JsonOf(const MetreOptions& options);

/// As a set's provenance has it in `scale`.
nlohmann::ordered_json JsonOf(const MetreReport& report);
/// Back from that. Throws nlohmann's exception where a field is missing or of another type.
MetreReport MetreReportFrom(const nlohmann::ordered_json& json);

/// {latitude_deg, longitude_deg, altitude_m}: the origin of a world with axes east, north, up. It
/// has an altitude.
nlohmann::ordered_json OriginJson(const io::GpsPosition& origin);

}  // namespace dtr::pipeline
