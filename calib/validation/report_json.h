// calib/validation/report_json.h -- internal to calib/validation: what all validation reports
// write alike. For their .cpp files only: shows the JSON library.
#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/validation/reprojection.h"
#include "dtr/types/check.h"

namespace dtr::calib {

/// JSON has no NaN: what was not measured is null.
nlohmann::ordered_json NumberOrNull(double value);

/// {count,rms_px,median_px,p95_px,worst_px,mean_x_px,mean_y_px}; nulls where count is 0.
nlohmann::ordered_json ToJsonValue(const ResidualStats& stats);

/// [{name,value,limit,passed,reason}].
nlohmann::ordered_json ToJsonValue(const std::vector<Check>& tests);

}  // namespace dtr::calib
