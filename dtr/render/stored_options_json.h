// dtr/render/stored_options_json.h -- internal to this project: RenderOptions as a JSON object, to
// be put into larger ones.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "dtr/render/options.h"

namespace dtr {

/// As ToJson (stored_options.h).
nlohmann::ordered_json JsonOf(const RenderOptions& options, const RenderOptions& base = {});

}  // namespace dtr
