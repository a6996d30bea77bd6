// calib/bundle/bundle_json.h -- internal to this project: reports of bundle adjustment as JSON
// objects, to be put into larger ones; public headers have the structs.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "calib/bundle/refine.h"
#include "calib/bundle/rig_adjust.h"

namespace dtr::calib {

/// {sigma_px, computed, condition, gauge_freedom, determined, lenses[].{names,matrix},
/// cameras[].{name,matrix}}; null where it was not computed.
nlohmann::ordered_json JsonOf(const CovarianceReport& report);

/// As ToJson (refine.h).
nlohmann::ordered_json JsonOf(const RefineReport& report);
/// Back from that, without the covariance. Throws nlohmann's exception where a field is missing or
/// of another type.
RefineReport RefineReportFrom(const nlohmann::ordered_json& json);

/// {scale, scale_spread, frames, pairs, free_sigma_px, sigma_px, rms_px, iterations,
/// points_dropped}.
nlohmann::ordered_json JsonOf(const RigReport& report);
/// Back from that; throws as RefineReportFrom does.
RigReport RigReportFrom(const nlohmann::ordered_json& json);

}  // namespace dtr::calib
