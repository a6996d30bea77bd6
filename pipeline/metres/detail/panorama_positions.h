// pipeline/metres/detail/panorama_positions.h -- where panoramas say that they were taken.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "pipeline/core/photo_positions.h"

namespace dtr::pipeline {

/// Of views of panoramas (capture::SplitPanoramas), whose folder this is: a place for each
/// panorama, called by the first of its views. Throws as capture::IngestPhotos.
PhotoPositions ReadPanoramaPositions(const std::filesystem::path& folder,
                                     const std::vector<std::string>& views, Progress& progress);

}  // namespace dtr::pipeline
