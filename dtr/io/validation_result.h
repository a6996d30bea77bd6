// dtr/io/validation_result.h -- what a set's validation result says, in a line.
#pragma once
#include <string>

#include "dtr/types/dtr_set.h"

namespace dtr::io {

/// "passed", "not validated", or "FAILED: TEST, ...; dtr validate says more".
std::string ValidationLine(const DtrSet& set);

/// A line to be shown wherever a set whose calibration failed its tests is used; empty for others.
std::string ValidationWarning(const DtrSet& set);

}  // namespace dtr::io
