// dtr/eval/report_json.h -- internal to this project: reports as JSON objects, to be put into
// larger ones; public headers have the structs.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "dtr/eval/cross_depth.h"

namespace dtr::eval {

/// As ToJson (json.h).
nlohmann::ordered_json JsonOf(const CrossDepthReport& report);

}  // namespace dtr::eval
