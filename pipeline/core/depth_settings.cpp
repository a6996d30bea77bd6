#include "pipeline/core/depth_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "calib/sfm/run/sfm.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

// The passes cost less than the search and ask more views: what few far views see, they settle.
// On plaza, share of all true pixels within 1 % before any check, with 5 and with 8 views in the
// passes: 86.6 % and 88.0 %. Every feature is compared with every one of the other photo: matching,
// which a large collection waits for, goes with their square. docs/accuracy/SPEED.md has what half
// of them cost in error.
constexpr Preset kPresets[] = {
    {.name = "fast",
     .max_size_px = 800,
     .features = 4096,
     .quality = {.neighbours = 4, .pass_neighbours = 6, .iterations = 2, .passes = 1}},
    {.name = "balanced",
     .max_size_px = 1024,
     .quality = {.neighbours = 5, .pass_neighbours = 8, .iterations = 3, .passes = 2}},
    {.name = "best",
     .max_size_px = 0,
     .quality = {.neighbours = 8, .pass_neighbours = 8, .iterations = 5, .passes = 3}},
};

}  // namespace

std::span<const Preset> Presets() { return kPresets; }

const Preset& PresetCalled(const std::string& name) {
  const auto found = std::find_if(std::begin(kPresets), std::end(kPresets),
                                  [&](const Preset& preset) { return name == preset.name; });
  if (found != std::end(kPresets)) return *found;
  throw UsageError(fmt::format("`preset`: expected fast, balanced or best, found '{}'", name));
}

stereo::QualitySettings Overridden(stereo::QualitySettings quality, const DepthChoice& choice) {
  quality.neighbours = choice.neighbours.value_or(quality.neighbours);
  quality.pass_neighbours = choice.pass_neighbours.value_or(quality.pass_neighbours);
  quality.iterations = choice.iterations.value_or(quality.iterations);
  quality.passes = choice.passes.value_or(quality.passes);
  return quality;
}

stereo::QualitySettings QualityOf(const DepthChoice& choice) {
  return Overridden(PresetCalled(choice.preset).quality, choice);
}

}  // namespace dtr::pipeline
