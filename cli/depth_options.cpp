#include "cli/depth_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "cli/number_checks.h"

namespace dtr::cli {

void AddDepthOptions(CLI::App& command, const std::vector<std::string>& engines,
                     const std::string& preset_help, pipeline::DepthChoice& choice) {
  command.add_option("--engine", choice.engine, "Depth engine [patchmatch]")
      ->check(CLI::IsMember(engines))
      ->type_name(fmt::format("{}", fmt::join(engines, "|")));
  std::vector<std::string> presets;
  for (const pipeline::Preset& preset : pipeline::Presets()) presets.emplace_back(preset.name);
  command.add_option("--preset", choice.preset, preset_help)
      ->check(CLI::IsMember(presets))
      ->type_name(fmt::format("{}", fmt::join(presets, "|")));
  const auto overriding = [&](const char* name, std::optional<int>& value, const char* help,
                              int least, int most) {
    command.add_option(name, value, std::string(help) + "; overrides the preset")
        ->check(CLI::Range(least, most))
        ->type_name("N");
  };
  command
      .add_option("--time-budget", choice.time_budget_s,
                  "Seconds for the depth stage on this machine: a measured probe picks neighbours, "
                  "iterations "
                  "and passes, which the set records")
      ->check(CLI::Range(1e-6, 1e9))
      ->type_name("S");
  command
      .add_option("--memory", choice.memory_gb,
                  "Memory to stay within; without it 4, or what the largest view needs")
      ->check(CLI::Range(0.001, 4096.0))
      ->type_name("GB");
  command
      .add_option("--workspace", choice.workspace,
                  "A dense workspace of this set for --engine colmap; without it COLMAP is run, "
                  "which needs CUDA")
      ->check(CLI::ExistingDirectory)
      ->type_name("DIR");
  CLI::Option* prior =
      command
          .add_option("--depth-prior", choice.prior.folder,
                      "Depth maps, or a capture, by a phone or depth camera, of any resolution: "
                      "stereo starts from them; with --engine prior they are the depth")
          ->check(CLI::ExistingPath)
          ->type_name("DIR");
  command
      .add_option("--prior-unit", choice.prior.unit,
                  "Scene units per number of a map of --depth-prior (0.001: millimetres of a set "
                  "in metres)")
      ->check(kPositive)
      ->needs(prior)
      ->type_name("U");
  command
      .add_option("--prior-kind", choice.prior.kind,
                  "z: along the optical axis; ray: distance from the camera [z]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, DepthKind>{
          {"z", DepthKind::kPlaneZ}, {"ray", DepthKind::kRayDistance}}))
      ->needs(prior)
      ->type_name("z|ray");
  command
      .add_option(
          "--depth-error", choice.depth_error_px,
          "Store depth in a fraction of the bytes, off by at most so many pixels of disparity "
          "[as good as exact]")
      ->check(CLI::Range(1e-6, 100.0))
      ->type_name("PX");
  command.add_flag("--completion,!--no-completion", choice.completion,
                   "Complete depth where none was measured, so that images are whole [on]");
  overriding("--neighbours", choice.neighbours, "Views that the search compares with", 1,
             pipeline::kMaxNeighbours);
  overriding("--pass-neighbours", choice.pass_neighbours,
             "Views that the geometric-consistency passes use", 1, pipeline::kMaxNeighbours);
  overriding("--iterations", choice.iterations, "Iterations per pixel and level of the search", 1,
             pipeline::kMaxIterations);
  overriding("--passes", choice.passes,
             "Geometric-consistency passes, in which views are checked against each other's planes",
             0, pipeline::kMaxPasses);
  // Names of 0.1, for one more release.
  command.add_option("--round-neighbours", choice.pass_neighbours)
      ->check(CLI::Range(1, pipeline::kMaxNeighbours))
      ->group("");
  command.add_option("--rounds", choice.passes)
      ->check(CLI::Range(0, pipeline::kMaxPasses))
      ->group("");
}

}  // namespace dtr::cli
