#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/output_file.h"
#include "dtr/advise/advise.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/build/advise.h"
#include "pipeline/core/depth_settings.h"
#include "viewer/advice_page.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct AdviseArguments {
  fs::path set, output;
  advise::AdviseOptions advise;
};

Json PlaceJson(const advise::Place& place, const DtrSet& set) {
  const Eigen::Vector3d center = place.cam_from_world.TargetOriginInSource() + set.world_origin;
  const Eigen::Vector3d axis = place.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  return {{"where", place.where},
          {"center", {center.x(), center.y(), center.z()}},
          {"looks_along", {axis.x(), axis.y(), axis.z()}},
          {"seen_share", place.seen_share},
          {"depthless_share", place.depthless_share},
          {"unseen_share", place.unseen_share},
          {"single_photo_share", place.single_share},
          {"gap_deg", place.gap_deg},
          {"poor", place.poor}};
}

std::string ToJson(const advise::Advice& advice, const DtrSet& set) {
  Json json;
  json["places"] = Json::array();
  for (const auto& place : advice.places) json["places"].push_back(PlaceJson(place, set));
  json["add"] = Json::array();
  for (const auto& addition : advice.add) {
    Json entry = PlaceJson(advice.places[addition.place], set);
    entry["poor_before"] = addition.poor_before;
    entry["poor_after"] = addition.poor_after;
    json["add"].push_back(entry);
  }
  json["adds_nothing"] = Json::array();
  for (const auto& view : advice.redundant) {
    json["adds_nothing"].push_back({{"name", view.name}, {"covered_share", view.covered_share}});
  }
  return json.dump(1);
}

void Say(const advise::Advice& advice, const advise::AdviseOptions& options, Console& console) {
  const auto poor = std::count_if(advice.places.begin(), advice.places.end(),
                                  [](const auto& place) { return place.poor; });
  console.Say(fmt::format("looked from {} positions between and beyond the cameras: {} are poor",
                          advice.places.size(), poor));
  for (const auto& addition : advice.add) {
    const auto& place = advice.places[addition.place];
    const std::string why = advise::WhyPoor(place, options);
    console.Say(fmt::format("  add a camera {}{}{}; poor positions {} -> {}", place.where,
                            why.empty() ? "" : ": ", why, addition.poor_before,
                            addition.poor_after));
  }
  for (const auto& view : advice.redundant) {
    console.Say(fmt::format("  {} adds nothing: others show {:.1f} % of its points as well",
                            view.name, 100 * view.covered_share));
  }
  if (advice.add.empty()) {
    console.Say(poor > 0 ? "  no single camera would do much for the poor ones"
                         : "  no camera is missing");
  }
  if (advice.redundant.empty()) console.Say("  every camera shows something of its own");
}

int Run(AdviseArguments options, const Context& context) {
  if (!options.output.empty()) RequireOutputFile(options.output, "-o", {".html", ".htm"});
  DtrSet set = io::ReadSet(options.set);
  RequireOneFrame(set);
  io::CollapseDuplicates(set);
  const auto views =
      pipeline::CoarseViewsOf(options.set, set, pipeline::kDefaultMemoryGb, context.console);
  if (views.size() < 2) {
    throw Error(
        fmt::format("{}: expected at least 2 source views with depth, found {}; run dtr stereo "
                    "first",
                    options.set.string(), views.size()));
  }
  const advise::Advice advice = advise::Advise(views, options.advise, context.console);
  Say(advice, options.advise, context.console);
  if (!options.output.empty()) {
    const std::string name = WithoutTrailingSlash(options.set).filename().string();
    WriteFileAtomically(options.output, viewer::AdvicePage(name, set, advice, options.advise));
    context.console.Say(options.output.string());
  }
  context.EmitJson(ToJson(advice, set));
  return kDone;
}

}  // namespace

void AddAdviseCommand(CLI::App& app) {
  AddCommand(app, "advise", "Where a set lacks a camera, and which of its cameras add nothing",
             "dtr advise scene.dtr -o advice.html", [](CLI::App& command) -> Action {
               auto options = std::make_shared<AdviseArguments>();
               command.add_option("SET", options->set, "The set")->required();
               command.add_option("-o,--output", options->output, "A page about it, an .html file");
               command
                   .add_option(
                       "--max-unseen", options->advise.max_unseen,
                       "A position is poor where more of what it sees is in no photo [0.05]")
                   ->check(CLI::Range(0.0, 1.0))
                   ->type_name("SHARE");
               command
                   .add_option("--max-gap", options->advise.max_gap_deg,
                               "... or the nearest photo of a point stands further off [15]")
                   ->check(CLI::Range(0.1, 180.0))
                   ->type_name("DEG");
               command
                   .add_option("--redundant", options->advise.redundant_share,
                               "A camera adds nothing where others show this share of it [0.99]")
                   ->check(CLI::Range(0.5, 1.0))
                   ->type_name("SHARE");
               command
                   .add_option("--add", options->advise.max_cameras_to_add,
                               "At most so many cameras to add [5]")
                   ->check(CLI::Range(0, 100))
                   ->type_name("N");
               return [options](const Context& context) { return Run(*options, context); };
             });
}

}  // namespace dtr::cli
