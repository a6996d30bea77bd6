// pipeline/metres/scale.h -- a set in metres.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/solve/board_scale.h"
#include "dtr/base/progress.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/scale_points.h"

namespace dtr::pipeline {

struct ScaleOptions {
  std::filesystem::path set;
  std::filesystem::path output;  ///< empty: `set` itself is replaced, whole or not at all
  bool force = false;
  std::vector<ScaleDistance> distances;  ///< or
  std::filesystem::path gps;  ///< the folder of the set's photos, with GPS in their EXIF; or
  std::optional<calib::Board> board;  ///< that lies in the scene, with a square in metres
};

/// A measured distance between two points of the set.
struct ScaledDistance {
  std::string text;       ///< as it was given
  double units = 0;       ///< between the points, in the set's unit before
  double length_m = 0;    ///< as it was measured
  double sigmas_off = 0;  ///< in standard deviations (calib::DistanceScale)
};

/// Positions of the photos' EXIF against the set's cameras (calib::PositionScale).
struct ScaledByPositions {
  size_t photos = 0;                  ///< with a position
  std::vector<std::string> left_out;  ///< of these, those that do not agree with the others
  bool settled = true;
  double rms_m = 0, turn_sigma_deg = 0;
  /// Of the world, whose axes are east, north, up; empty: axes are as before.
  std::optional<io::GpsPosition> origin;
};

/// A board that lay in the scene.
struct ScaledByBoard {
  std::string board;        ///< as calib::TextOf
  calib::BoardScale scale;  ///< `left_out`: views without the board, too
};

struct ScaleReport {
  std::filesystem::path written;
  double metres_per_unit = 1, relative_sigma = 0;
  std::vector<std::string> lines;  ///< for people
  /// As the scale was asked for: one of these three.
  std::vector<ScaledDistance> distances;
  std::optional<ScaledByPositions> positions;
  std::optional<ScaledByBoard> board;
};

/// JSON object: metres_per_unit, relative_sigma, method, the fields of the method (as the set's
/// provenance keeps them in `scale`), set, unit.
std::string ToJson(const ScaleReport& report);

/// Finds the length of the set's unit and writes the set in metres: cameras, depth, sigma, meshes,
/// points, scene centre, bounds, baselines, origin. With GPS the world also gets axes east, north
/// and up, unless the cameras leave the turn uncertain by more than 5 degrees. Images are copied
/// byte by byte. Throws Error as calib/scale.h and calib/solve/board_scale.h do.
ScaleReport ScaleSet(const ScaleOptions& options, Progress& progress);

}  // namespace dtr::pipeline
