// calib/files/summary_json.h -- internal to this project: what a calibration found as a JSON
// object, to be put into larger ones.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "calib/files/calibration.h"

namespace dtr::calib {

/// The cameras, views (name, RMS, corner count, outliers) and models by the field names of
/// calibration files, without the observations. Names come from files: they may be any bytes.
nlohmann::ordered_json SummaryJson(const Calibration& calibration);

}  // namespace dtr::calib
