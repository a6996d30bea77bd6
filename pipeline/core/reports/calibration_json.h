// pipeline/core/reports/calibration_json.h -- CalibrationReport as JSON, and back from a
// checkpoint.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "pipeline/core/calibration_report.h"

namespace dtr::pipeline {

/// As a set's provenance has it under `calibration`: the fields of `sfm` and `points`, then `rig`,
/// `camera_sharing`, `bundle_adjustment`, `exif_focal` and `given_cameras` where there are such.
nlohmann::ordered_json JsonOf(const CalibrationReport& report);

/// {pairs, matches, residual_px, limit_px, fits, found[].{name,advice,residual_px}}; residual_px
/// null where there were too few matches.
nlohmann::ordered_json JsonOf(const calib::ConventionReport& report);

/// {camera_per, tests[]}; no tests where no group of photos lies in several folders.
nlohmann::ordered_json JsonOf(const CameraSharing& sharing);

/// The part of it that comes of bundle adjustment alone, `rig`, `camera_sharing` and
/// `bundle_adjustment`, for checkpoints.
nlohmann::ordered_json RefinementJson(const CalibrationReport& report);
/// Back from that: RefinementJson of it gives the same text. The rig is the one that was used: its
/// rotations would not come back bit by bit. Throws nlohmann's exception where a field is missing
/// or of another type, std::bad_optional_access where the rig is missing.
CalibrationReport RefinementFrom(const nlohmann::ordered_json& json,
                                 const std::optional<SetRig>& rig);

}  // namespace dtr::pipeline
