#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/render_options.h"
#include "cli/sweep_output.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/run_record.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/set_stream.h"
#include "pipeline/validate/validate.h"
#include "viewer/inspect_page.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct InspectArguments {
  fs::path set, output, bench;
  double memory_gb = 4;
};

double NumberOr(const Json& object, const char* name, double otherwise) {
  const auto found = object.find(name);
  return found != object.end() && found->is_number() ? found->get<double>() : otherwise;
}

std::string TextOr(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// The list below `name`, empty where there is none.
Json ListOf(const Json& object, const char* name) {
  if (!object.is_object() || !object.contains(name) || !object[name].is_array())
    return Json::array();
  return object[name];
}

std::vector<Check> ChecksOf(const DtrSet& set) {
  std::vector<Check> checks;
  for (const Json& test : ListOf(Json::parse(set.validation_json, nullptr, false), "tests")) {
    if (!test.is_object()) continue;
    const auto passed = test.find("passed");
    checks.push_back({TextOr(test, "name"), NumberOr(test, "value", NAN),
                      NumberOr(test, "limit", NAN),
                      passed != test.end() && passed->is_boolean() && passed->get<bool>(),
                      TextOr(test, "reason")});
  }
  return checks;
}

/// Of report/run.json; a set may have none, or that of another program.
std::vector<viewer::StageCost> StagesOf(const fs::path& set) {
  std::vector<viewer::StageCost> stages;
  for (const io::RunStage& stage : io::ReadRunStages(set)) {
    stages.push_back(
        {stage.name, stage.wall_s, stage.cpu_s, 1024 * static_cast<double>(stage.peak_rss_kib)});
  }
  return stages;
}

/// What `dtr bench` found, from where it was told to be, or from where it is written by default.
std::optional<SweepFacts> BenchOf(const InspectArguments& options) {
  constexpr std::uintmax_t kFileLimitBytes = 64 << 20;
  const bool told = !options.bench.empty();
  const fs::path file = (told ? options.bench : SweepFolderOf(options.set)) / kSweepFile;
  if (!told && !fs::exists(file)) return std::nullopt;
  if (!fs::exists(file)) {
    throw Error("--bench " + options.bench.string() + ": expected " + kSweepFile +
                " of dtr bench in it, found none");
  }
  return ReadSweep(ReadFile(file, kFileLimitBytes), file.string());
}

viewer::InspectFacts FactsOf(const InspectArguments& options, const DtrSet& set) {
  viewer::InspectFacts facts;
  facts.name = WithoutTrailingSlash(options.set).filename().string();
  facts.checks = ChecksOf(set);
  facts.stages = StagesOf(options.set);
  const calib::ValidateLimits limits;
  facts.error_limit_px = limits.max_camera_rms_px;
  if (set.sparse_file) {
    const auto report = pipeline::ReprojectionOfSet(set, io::LoadSparse(options.set, set), limits);
    for (const auto& camera : report.cameras) {
      if (camera.held_out.count < limits.min_observations) continue;
      facts.error_px[camera.name] = camera.held_out.rms_px;
    }
  }
  facts.load = [folder = options.set](const View& view) {
    View loaded = view;
    io::LoadOptions load;
    load.sigma = true;
    io::LoadPixels(folder, loaded, load);
    return loaded;
  };
  return facts;
}

int RunInspect(const InspectArguments& options, const Context& context) {
  RequireOutputFile(options.output, "-o", {".html", ".htm"});
  DtrSet set = io::ReadSet(options.set);
  RequireOneFrame(set);
  const std::optional<SweepFacts> bench = BenchOf(options);
  viewer::InspectFacts facts = FactsOf(options, set);
  if (bench) {
    facts.add_further = [&bench](report::HtmlReport& page) {
      page.Section("What settings cost and are worth");
      page.Paragraph("Measured by dtr bench, of " + bench->set + ".");
      AddSweep(page, *bench);
    };
  }
  io::CollapseDuplicates(set);
  const auto stream = pipeline::StreamOf(options.set, set, {DescribeRenderScene(set)},
                                         {options.memory_gb}, context.console);
  RenderOptions render = StoredRenderOptions(set);
  WriteFileAtomically(options.output,
                      viewer::InspectPage(set, *stream, facts, render, context.console));
  context.console.Say(options.output.string());
  context.EmitJson(nlohmann::ordered_json{{"file", options.output.string()}}.dump(1));
  return kDone;
}

}  // namespace

void AddInspectCommand(CLI::App& app) {
  AddCommand(
      app, "inspect", "One offline page of what is good and bad in a set",
      "dtr inspect scene.dtr -o report.html", [](CLI::App& command) -> Action {
        auto options = std::make_shared<InspectArguments>();
        command.add_option("SET", options->set, "The set")->required();
        command.add_option("-o,--output", options->output, "The page, an .html file")->required();
        command
            .add_option("--bench", options->bench,
                        "Folder that dtr bench wrote; its plots and findings go on the page "
                        "[NAME-bench beside the set, where it is]")
            ->type_name("DIR");
        AddMemoryOption(command, options->memory_gb,
                        "Memory for the views' pixels; others are dropped and read again [4]");
        return [options](const Context& context) { return RunInspect(*options, context); };
      });
}

}  // namespace dtr::cli
