// dtr/types/check_json.h -- internal to this project: tests as JSON. Header only, for sources that
// use the JSON library anyway.
#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "dtr/base/json_number.h"
#include "dtr/types/check.h"

namespace dtr {

/// [{name,value,limit,passed,reason}].
inline nlohmann::ordered_json JsonOf(const std::vector<Check>& tests) {
  auto json = nlohmann::ordered_json::array();
  for (const Check& test : tests) {
    json.push_back({{"name", test.name},
                    {"value", NumberOrNull(test.value)},
                    {"limit", NumberOrNull(test.limit)},
                    {"passed", test.passed},
                    {"reason", test.reason}});
  }
  return json;
}

}  // namespace dtr
