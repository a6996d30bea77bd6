#include "pipeline/core/depth/quality_json.h"

#include <cstdint>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"

namespace dtr::pipeline {

stereo::QualitySettings QualityFromJson(const std::string& text, const std::string& where) {
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
          .pass_neighbours = number("pass_neighbours", 1, kMaxNeighbours),
          .iterations = number("iterations", 1, kMaxIterations),
          .passes = number("passes", 0, kMaxPasses)};
}

nlohmann::ordered_json SettingsJson(const std::string& engine,
                                    const stereo::QualitySettings& quality) {
  nlohmann::ordered_json settings = {{"engine", engine}};
  if (engine == "sgbm" || engine == "patchmatch") settings["neighbours"] = quality.neighbours;
  if (engine == "patchmatch") {
    settings["pass_neighbours"] = quality.pass_neighbours;
    settings["iterations"] = quality.iterations;
    settings["passes"] = quality.passes;
  }
  return settings;
}

}  // namespace dtr::pipeline
