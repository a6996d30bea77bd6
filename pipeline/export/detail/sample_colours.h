// pipeline/export/detail/sample_colours.h -- colours of a view's depth samples.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>

#include "dtr/types/view.h"

namespace dtr::pipeline {

/// The photo of a view on the grid of its depth map, in the set's mean exposure (RENDER_SPEC 4.4):
/// 8-bit sRGB, means of depth_scale x depth_scale pixels. `view`: without pixels.
ImageRgb8 ColoursOnDepthGrid(const std::filesystem::path& set_folder, View view);

}  // namespace dtr::pipeline
