// pipeline/core/depth/quality_json.h -- the settings of a depth engine in records.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "pipeline/core/depth_settings.h"

namespace dtr::pipeline {

/// What of the engine and its quality settings decides the bytes of a depth map, by the names of
/// the options: given explicitly, they make the same maps whatever preset they came from.
nlohmann::ordered_json SettingsJson(const std::string& engine,
                                    const stereo::QualitySettings& quality);
/// The quality settings in what SettingsJson gave for `patchmatch`. Throws Error naming `where`,
/// also where it has more than the most.
stereo::QualitySettings QualityFromJson(const std::string& text, const std::string& where);

}  // namespace dtr::pipeline
