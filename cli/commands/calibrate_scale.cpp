#include <fmt/format.h>

#include <filesystem>

#include "cli/commands/calibrate_scale.h"
#include "cli/metre_options.h"
#include "dtr/base/error.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/view_names.h"
#include "pipeline/metres/scale.h"

namespace dtr::cli {
namespace {

struct CalibrateScaleArguments {
  pipeline::ScaleOptions scale;
  std::vector<std::string> distances;
  std::string board;
};

// The views of the set that somebody named.
void NameViews(const DtrSet& set, pipeline::ScalePoint& point) {
  for (pipeline::ScaleClick& click : point.clicks)
    click.view_id = pipeline::FindView(set, click.view_id).id;
}

calib::Board MetricBoard(const std::string& text) {
  const calib::Board board = calib::BoardFromText(text);
  if (board.metric) return board;
  throw UsageError(fmt::format(
      "--board {}: expected a square in mm, cm or m, found a length without a unit", text));
}

int RunScale(CalibrateScaleArguments options, const Context& context) {
  context.console.KeepsWork();
  const int ways = (options.distances.empty() ? 0 : 1) + (options.scale.gps.empty() ? 0 : 1) +
                   (options.board.empty() ? 0 : 1);
  if (ways != 1) {
    throw UsageError(
        fmt::format("calibrate scale: expected --distance (once or more), --board or --gps, found "
                    "{}",
                    ways == 0 ? "none of them" : "several"));
  }
  if (!options.board.empty()) options.scale.board = MetricBoard(options.board);
  const DtrSet set = io::ReadSet(options.scale.set);
  RequireOneFrame(set);
  for (const std::string& text : options.distances) {
    pipeline::ScaleDistance distance = DistanceFrom(text, DistanceEnds::kPoints);
    NameViews(set, distance.a);
    NameViews(set, distance.b);
    options.scale.distances.push_back(std::move(distance));
  }
  const auto report = pipeline::ScaleSet(options.scale, context.console);
  for (const std::string& line : report.lines) context.console.Say(line);
  context.console.Say(fmt::format("{}: one unit was {:.6g} m +- {:.2g} %; the set is in metres now",
                                  report.written.string(), report.metres_per_unit,
                                  100 * report.relative_sigma));
  context.EmitJson(pipeline::ToJson(report));
  return kDone;
}

}  // namespace

void AddCalibrateScaleCommand(CLI::App& calibrate) {
  AddCommand(calibrate, "scale", "Give a set its size in metres",
             "dtr calibrate scale scene.dtr --distance 0001:640:410,0001:902:398=2.5m",
             [](CLI::App& command) -> Action {
               auto options = std::make_shared<CalibrateScaleArguments>();
               pipeline::ScaleOptions& scale = options->scale;
               command.add_option("SET", scale.set, "The set")->required();
               command
                   .add_option("-o,--output", scale.output,
                               "The set to write; without it SET itself is replaced, whole or not "
                               "at all")
                   ->type_name("SET2");
               command
                   .add_option("--distance", options->distances,
                               "A measured distance between two points of the set's images: each "
                               "VIEW:X:Y where the view has depth, VIEW:X:Y+VIEW2:X:Y to be "
                               "triangulated, or VIEW for the camera itself; LENGTH as 2.5m, or "
                               "2.5m+-5mm with its standard deviation; may be given more than once")
                   ->type_name("A,B=LENGTH");
               command
                   .add_option("--board", options->board,
                               "A board that stood still in the scene and is seen in 3 views or "
                               "more, as calibrate board takes it, with a unit: "
                               "chessboard:9x6:25mm")
                   ->type_name("BOARD");
               command
                   .add_option("--gps", scale.gps,
                               "Folder of the set's photos, with positions in EXIF")
                   ->check(CLI::ExistingDirectory)
                   ->type_name("PHOTOS");
               command.add_flag("--force", scale.force, "Replace SET2 when it exists");
               return [options](const Context& context) { return RunScale(*options, context); };
             });
}

}  // namespace dtr::cli
