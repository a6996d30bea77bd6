// pipeline/build/detail/build_json.h -- what a build records, as JSON.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "pipeline/build/build.h"
#include "pipeline/core/calibrate.h"

namespace dtr::pipeline {

/// Everything that can change a byte of the set, and nothing else: threads and memory do not.
nlohmann::ordered_json OptionsJson(const BuildOptions& options,
                                   const stereo::QualitySettings& quality);

/// Of `fingerprint`, a build's with its options under `options`, what decides everything before
/// depth: the same for any choice of depth, and no build's own.
nlohmann::ordered_json BeforeDepth(const BuildOptions& options, nlohmann::ordered_json fingerprint);

/// The provenance of the set; `option_values` and `photos` as they stand in it.
nlohmann::ordered_json ProvenanceJson(const BuildOptions& options,
                                      const nlohmann::ordered_json& option_values,
                                      const nlohmann::ordered_json& photos,
                                      const CalibratedPhotos& calibrated,
                                      const BuildReport& report);

/// [{name, remarks[]}].
nlohmann::ordered_json ScreeningJson(const BuildReport& report);

}  // namespace dtr::pipeline
