// cli/metre_options.h -- --distance, --gps and --gps-sigma of the commands that take them.
#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/core/metres.h"
#include "pipeline/core/scale_points.h"

namespace dtr::cli {

/// `--distance` between the cameras of two photos, `--gps-sigma`, as they were typed.
struct MetreWords {
  std::vector<std::string> distances;
  std::optional<std::string> gps_sigma;
};

/// What a distance may be measured between.
enum class DistanceEnds {
  kPoints,   ///< pixels of a set's views, or cameras: as `dtr calibrate scale` takes them
  kCameras,  ///< photos: as a refinement takes them
};

/// What `--distance A,B=LENGTH` says; views are called as they were typed. Throws UsageError, which
/// shows the form that is possible here.
pipeline::ScaleDistance DistanceFrom(const std::string& text, DistanceEnds ends);

/// Adds the flag --gps of commands that take in photos themselves.
CLI::Option* AddGpsFlag(CLI::App& command, bool& gps);

/// Adds --distance, once or more, of two cameras, and --gps-sigma, which needs `gps`; --distance.
CLI::Option* AddMetreOptions(CLI::App& command, CLI::Option& gps, MetreWords& words);

/// What was asked for. Throws UsageError where a word cannot be read.
pipeline::MetreOptions MetreOptionsFrom(bool gps, const MetreWords& words);

}  // namespace dtr::cli
