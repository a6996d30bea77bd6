// pipeline/detail/pages/validation_page.h -- the reprojection tests of a set as a page.
#pragma once
#include <filesystem>
#include <string>

#include "calib/validation/reprojection.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// Result and tests; a table of the views; for every size of image, all views together: residual
/// vectors, coverage, and how uncertain the image is where the fresh bundle adjustment told; and
/// the worst views, drawn over their images, read from `folder` one at a time. `set` and `report`
/// belong together (validate_set.h). Deterministic.
std::string ValidationPage(const std::filesystem::path& folder, const DtrSet& set,
                           const calib::ValidationReport& report, const std::string& title);

}  // namespace dtr::pipeline
