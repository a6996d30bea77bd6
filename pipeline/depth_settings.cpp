#include "pipeline/depth_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "calib/colmap/sfm.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

// The rounds cost less than the search and ask more views: what few far views see, they settle.
// On plaza, share of all true pixels within 1 % before any check, with 5 and with 8 views in the
// rounds: 86.6 % and 88.0 %. Every feature is compared with every one of the other photo: matching,
// which a large collection waits for, goes with their square. docs/accuracy/SPEED.md has what half
// of them cost in error.
constexpr Preset kPresets[] = {
    {.name = "fast",
     .max_size_px = 800,
     .features = 4096,
     .effort = {.neighbours = 4, .round_neighbours = 6, .iterations = 2, .rounds = 1}},
    {.name = "balanced",
     .max_size_px = 1024,
     .features = colmap::kMostFeatures,
     .effort = {.neighbours = 5, .round_neighbours = 8, .iterations = 3, .rounds = 2}},
    {.name = "best",
     .max_size_px = 0,
     .features = colmap::kMostFeatures,
     .effort = {.neighbours = 8, .round_neighbours = 8, .iterations = 5, .rounds = 3}},
};

}  // namespace

std::span<const Preset> Presets() { return kPresets; }

const Preset& PresetCalled(const std::string& name) {
  const auto found = std::find_if(std::begin(kPresets), std::end(kPresets),
                                  [&](const Preset& preset) { return name == preset.name; });
  if (found != std::end(kPresets)) return *found;
  throw UsageError(fmt::format("--preset: expected fast, balanced or best, found '{}'", name));
}

stereo::Effort Overridden(stereo::Effort effort, const DepthChoice& choice) {
  effort.neighbours = choice.neighbours.value_or(effort.neighbours);
  effort.round_neighbours = choice.round_neighbours.value_or(effort.round_neighbours);
  effort.iterations = choice.iterations.value_or(effort.iterations);
  effort.rounds = choice.rounds.value_or(effort.rounds);
  return effort;
}

stereo::Effort EffortOf(const DepthChoice& choice) {
  return Overridden(PresetCalled(choice.preset).effort, choice);
}

stereo::Effort EffortFromJson(const std::string& text, const std::string& where) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  const auto number = [&](const char* name, int least, int most) {
    const bool given = json.is_object() && json.contains(name) && json[name].is_number_integer();
    const auto value = given ? json[name].get<std::int64_t>() : least - 1;
    if (value < least || value > most) {
      throw Error(where +
                  ": expected the settings that a time budget picked, found something else; delete "
                  "the partial set and build again");
    }
    return static_cast<int>(value);
  };
  return {.neighbours = number("neighbours", 1, kMaxNeighbours),
          .round_neighbours = number("round_neighbours", 1, kMaxNeighbours),
          .iterations = number("iterations", 1, kMostIterations),
          .rounds = number("rounds", 0, kMaxRounds)};
}

nlohmann::ordered_json SettingsJson(const std::string& engine, const stereo::Effort& effort) {
  nlohmann::ordered_json settings = {{"engine", engine}};
  if (engine == "sgbm" || engine == "patchmatch") settings["neighbours"] = effort.neighbours;
  if (engine == "patchmatch") {
    settings["round_neighbours"] = effort.round_neighbours;
    settings["iterations"] = effort.iterations;
    settings["rounds"] = effort.rounds;
  }
  return settings;
}

}  // namespace dtr::pipeline
