// pipeline/scale.h -- a set in metres.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "dtr/base/progress.h"
#include "pipeline/scale_points.h"

namespace dtr::pipeline {

struct ScaleOptions {
  std::filesystem::path set;
  std::filesystem::path output;  ///< empty: `set` itself is replaced, whole or not at all
  bool force = false;
  std::vector<ScaleDistance> distances;  ///< or
  std::filesystem::path gps;  ///< the folder of the set's photos, with GPS in their EXIF; or
  std::optional<calib::Board> board;  ///< that lies in the scene, with a square in metres
  int threads = 0;
};

struct ScaleReport {
  std::filesystem::path written;
  double metres_per_unit = 1, relative_sigma = 0;
  std::vector<std::string> lines;  ///< for people
  std::string json;                ///< what the set's provenance keeps, too
};

/// Finds the length of the set's unit and writes the set in metres: cameras, depth, sigma, meshes,
/// points, scene centre, bounds, baselines, origin. With GPS the world also gets axes east, north
/// and up, unless the cameras leave the turn uncertain by more than 5 degrees. Images are copied
/// byte by byte. Throws Error as calib/scale.h and calib/solve/board_scale.h do.
ScaleReport ScaleSet(const ScaleOptions& options, Progress& progress);

}  // namespace dtr::pipeline
