// pipeline/detail/web/depth_coder.h -- both depth maps of a view as few bytes (docs/EXPORT.md,
// "Depth").
#pragma once
#include <cstdint>
#include <string>

#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// Codes of measured and of completed depth of the same size (`completed` may be empty); 0: none.
/// No pixel has both. Without loss; viewer/web/js/depth_codes.js reads it.
std::string EncodeDepthCodes(const Grid<std::uint16_t>& measured,
                             const Grid<std::uint16_t>& completed);

}  // namespace dtr::pipeline
