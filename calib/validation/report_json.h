// calib/validation/report_json.h -- internal to this project: reports of validation as JSON
// objects, to be put into larger ones; public headers have the structs.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "calib/validation/boards.h"
#include "calib/validation/photos.h"
#include "calib/validation/reprojection.h"

namespace dtr::calib {

/// As ToJson of the same struct (reprojection.h, boards.h, photos.h).
nlohmann::ordered_json JsonOf(const ValidationReport& report);
nlohmann::ordered_json JsonOf(const BoardValidation& report);
nlohmann::ordered_json JsonOf(const PhotosValidation& report);

/// {count,rms_px,median_px,p95_px,worst_px,mean_x_px,mean_y_px}; nulls where count is 0.
nlohmann::ordered_json JsonOf(const ResidualStats& stats);

}  // namespace dtr::calib
