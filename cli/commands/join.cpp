#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/number_checks.h"
#include "pipeline/build/join.h"

namespace dtr::cli {

void AddJoinCommand(CLI::App& app) {
  struct Options {
    std::vector<std::filesystem::path> sets;
    std::filesystem::path output;
    std::string video;
    pipeline::JoinOptions join;
  };
  AddCommand(
      app, "join", "Make a dynamic set of sets of one time step or several, in their order",
      "dtr join t0.dtr t1.dtr -o dynamic.dtr --fps 24", [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_option("SETS", options->sets, "Sets of a time step or several, first to last")
            ->required();
        command.add_option("-o,--output", options->output, "The set to write, NAME.dtr")
            ->required()
            ->type_name("SET.dtr");
        command
            .add_option("--fps", options->join.frames_per_second,
                        "Frames per second of time, of sets of one time step [24]")
            ->check(kPositive)
            ->type_name("F");
        command
            .add_option("--video", options->video,
                        "Store the images of source cameras as H.264 videos of this rate factor, "
                        "1 (largest) to 51, or lossless [every image a PNG]")
            ->type_name("CRF");
        command.add_flag("--force", options->join.force, "Replace a set that exists");
        return [options](const Context& context) -> int {
          context.console.KeepsWork();
          pipeline::JoinOptions join = options->join;
          if (!options->video.empty()) join.video = io::VideoQualityFrom(options->video);
          const size_t frames =
              pipeline::JoinSets(options->sets, options->output, join, context.console);
          context.console.Say(fmt::format("{}: {} frames", options->output.string(), frames));
          context.EmitJson(
              nlohmann::json{{"set", options->output.string()}, {"frames", frames}}.dump(1));
          return kDone;
        };
      });
}

}  // namespace dtr::cli
