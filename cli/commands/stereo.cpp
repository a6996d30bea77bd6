#include <fmt/format.h>

#include <filesystem>

#include "cli/command.h"
#include "cli/depth_options.h"
#include "pipeline/build/stereo.h"

namespace dtr::cli {

void AddStereoCommand(CLI::App& app) {
  AddCommand(
      app, "stereo", "Compute depth maps for a calibrated set",
      "dtr stereo scene.dtr --engine patchmatch -o with_depth.dtr",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<pipeline::RecomputeOptions>();
        command.add_option("SET", options->set, "The set")->required();
        command
            .add_option("-o,--output", options->output,
                        "The set to write; without it SET itself is replaced, whole or not at all")
            ->type_name("SET2");
        AddDepthOptions(command, {"sgbm", "patchmatch", "colmap", "prior"},
                        "Work spent on a depth map; the images keep their size [balanced]",
                        options->depth);
        command
            .add_option("--normals", options->normals,
                        "Also write each source view's surface normals: unit vectors in its "
                        "camera's frame, 0 where unknown, as DIR/NAME.exr")
            ->type_name("DIR");
        command.add_flag("--force", options->force, "Replace SET2 when it exists");
        return [options](const Context& context) -> int {
          context.console.KeepsWork();
          options->seed = context.common.seed;
          const auto report = pipeline::RecomputeDepth(*options, context.console);
          context.console.Say(fmt::format("{}: {} depth maps, {:.1f} % of the pixels have depth",
                                          report.written.string(), report.depth_maps,
                                          100 * report.depth_completeness));
          context.EmitJson(pipeline::ToJson(report));
          return kDone;
        };
      });
}

}  // namespace dtr::cli
