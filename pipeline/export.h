// pipeline/export.h -- a set's cameras, points and images for other programs.
#pragma once
#include <cstddef>
#include <filesystem>

#include "dtr/base/progress.h"

namespace dtr::pipeline {

struct ExportRequest {
  std::filesystem::path set;
  std::filesystem::path output;  ///< folder to write: images/ and sparse/0
  bool text = false;             ///< COLMAP's text files instead of binary
  int threads = 0;
};

struct ExportReport {
  size_t images = 0, points = 0;
  bool points_from_depth = false;  ///< as the set has no sparse points
};

/// Writes a COLMAP model with its images, which keep the names of the photos but for the extension
/// of what the set stores. Throws UsageError when the output exists, Error for a broken set.
ExportReport ExportColmap(const ExportRequest& request, Progress& progress);

}  // namespace dtr::pipeline
