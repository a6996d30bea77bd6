// capture/capture_json.h -- internal to capture: the text of capture.json.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "capture/photo.h"

namespace dtr::capture {

/// The list as JSON text. `Photo::file` must be relative to the capture's folder.
std::string CaptureToJson(const Capture& capture);

/// Inverse; `source` is named in errors. Every field is checked; file names stay in their folder.
Capture CaptureFromJson(std::string_view text, const std::string& source);

}  // namespace dtr::capture
