// pipeline/core/depth_settings.h -- presets, and what of them the command line overrides.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "pipeline/core/depth_prior.h"
#include "stereo/engine.h"

namespace dtr::pipeline {

/// Settings that belong together, by name.
struct Preset {
  const char* name;
  int max_size_px;   ///< long side of the images of a set that is built; 0: full size
  int features = 0;  ///< max per photo of structure from motion; 0: the engine's max
  stereo::QualitySettings quality;
};

/// The table of presets, cheapest first. `dtr bench --stage stereo` measures what each costs and
/// gives.
std::span<const Preset> Presets();
/// Throws UsageError for unknown names.
const Preset& PresetCalled(const std::string& name);

/// Memory to stay within unless told otherwise.
inline constexpr double kDefaultMemoryGb = 4;

/// The max of each in quality settings; passes may be none, the others are 1 at least.
inline constexpr int kMaxNeighbours = 8, kMaxIterations = 20, kMaxPasses = 8;

/// What was asked for: a preset, and what overrides it.
struct DepthChoice {
  std::string engine = "patchmatch";  ///< "none": no depth; "prior": that of `prior`, as it is
  std::string preset = "balanced";
  std::optional<int> neighbours, pass_neighbours, iterations, passes;
  std::optional<double> time_budget_s;  ///< picks what is not given explicitly
  std::optional<double> memory_gb;      ///< gigabytes; absent: kDefaultMemoryGb, or what is needed
  /// Pixels of disparity that storing may move a depth; absent: png16-inverse, practically exact.
  std::optional<double> depth_error_px;
  bool completion = true;           ///< depth is completed where none was measured
  std::filesystem::path workspace;  ///< for engine "colmap"; empty: the program fills one
  DepthPriorChoice prior;           ///< for engines "patchmatch" and "prior"
};

/// Quality settings with what the choice gives explicitly in its place.
stereo::QualitySettings Overridden(stereo::QualitySettings quality, const DepthChoice& choice);

/// The quality settings of a choice, but for a time budget.
stereo::QualitySettings QualityOf(const DepthChoice& choice);

}  // namespace dtr::pipeline
