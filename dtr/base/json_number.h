// dtr/base/json_number.h -- internal to this project: numbers that JSON has no word for. Header
// only, for sources that use the JSON library anyway: dtr_base itself links none.
#pragma once
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

namespace dtr {

/// JSON has neither NaN nor infinity: what was not measured, or is not defined, is null.
inline nlohmann::ordered_json NumberOrNull(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}
inline nlohmann::ordered_json NumberOrNull(const std::optional<double>& value) {
  return value ? NumberOrNull(*value) : nlohmann::ordered_json(nullptr);
}

/// Back from that: null is NaN. Throws nlohmann's exception for anything else.
inline double NumberOrNan(const nlohmann::ordered_json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

}  // namespace dtr
