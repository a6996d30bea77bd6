#include <fmt/format.h>

#include <algorithm>

#include "cli/build_arguments.h"
#include "cli/command.h"
#include "cli/not_registered.h"
#include "pipeline/build/build.h"
#include "pipeline/dynamic/build_dynamic.h"

namespace dtr::cli {
namespace {

pipeline::BuildReport Build(const BuildArguments& arguments, Progress& progress) {
  if constexpr (DTR_WITH_DYNAMIC) {
    if (arguments.is_dynamic) {
      return pipeline::BuildDynamicSet(arguments.options, arguments.dynamic, progress);
    }
  }
  return pipeline::BuildSet(arguments.options, progress);
}

void SayResult(const pipeline::BuildOptions& options, const pipeline::BuildReport& report,
               Console& console) {
  if (report.set.frames.size() > 1) {
    console.Say(
        fmt::format("{}: {} time steps of:", options.output.string(), report.set.frames.size()));
  }
  const auto& views = report.set.frames.front().views;
  const auto held_out = std::count_if(
      views.begin(), views.end(), [](const View& view) { return view.role == ViewRole::kHeldOut; });
  console.Say(fmt::format("{}: {} views to render from, {} held out", options.output.string(),
                          static_cast<long>(views.size()) - held_out, held_out));
  SayNotRegistered(report.not_registered, report.why_not_registered, console);
  for (const auto& [name, reason] : report.skipped) {
    console.Say(fmt::format("  skipped: {}: {}", name, reason));
  }
  if (report.validated) {
    console.Say(report.validation_passed
                    ? "  calibration: reprojection tests passed"
                    : "  calibration: REPROJECTION TESTS FAILED; dtr validate says which");
  }
  for (const std::string& line : report.coverage) console.Say("  " + line);
  if (!report.coverage.empty()) {
    console.Say(fmt::format("  dtr advise {} says where", options.output.string()));
  }
}

}  // namespace

void AddBuildCommand(CLI::App& app) {
  AddCommand(app, "build", "Build a D+TR set from photos or videos",
             "dtr build photos/ -o scene.dtr --holdout every:8", [](CLI::App& command) -> Action {
               auto arguments = std::make_shared<BuildArguments>();
               AddBuildOptions(command, *arguments);
               return [arguments](const Context& context) -> int {
                 context.console.KeepsWork();
                 FinishBuildArguments(context.common, *arguments);
                 const pipeline::BuildOptions& options = arguments->options;
                 if (const auto part = PartOf(*arguments)) {
                   pipeline::RunBuildPart(options, *part, context.console);
                   context.console.Say(
                       fmt::format("{}: done: {}", options.output.string(), NameOf(*part)));
                   return kDone;
                 }
                 const auto report = Build(*arguments, context.console);
                 SayResult(options, report, context.console);
                 context.EmitJson(pipeline::ToJson(report));
                 return kDone;
               };
             });
}

}  // namespace dtr::cli
