// capture/contents_json.h -- internal to this project: FolderContents as a JSON object, to be put
// into larger ones.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "capture/contents.h"

namespace dtr::capture {

/// {photos, masks, depth_maps, videos, cameras, ignored[].{kind,files,where,reason}}. Names of
/// folders may be any bytes: to be printed with error_handler_t::replace.
nlohmann::ordered_json JsonOf(const FolderContents& contents);

}  // namespace dtr::capture
