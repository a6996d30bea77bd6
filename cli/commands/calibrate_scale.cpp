#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>

#include "calib/boards/length.h"
#include "cli/commands/calibrate_scale.h"
#include "cli/pipeline/scale_set.h"
#include "cli/view_names.h"
#include "dtr/base/error.h"
#include "dtr/io/set_io.h"
#include "dtr/render/instants.h"

namespace dtr::cli {
namespace {

struct Options {
  pipeline::ScaleOptions scale;
  std::vector<std::string> distances;
  std::string board;
};

[[noreturn]] void Refuse(const std::string& text, const std::string& what) {
  throw UsageError(fmt::format(
      "--distance {}: {}; expected A,B=LENGTH, as 0001:640:410,0001:902.5:398=2.5m: A and B each "
      "VIEW:X:Y, VIEW:X:Y+VIEW2:X:Y or VIEW (the camera itself), LENGTH in mm, cm or m",
      text, what));
}

std::vector<std::string> Split(const std::string& text, char at) {
  std::vector<std::string> parts{""};
  for (const char c : text) {
    if (c == at) {
      parts.emplace_back();
    } else {
      parts.back().push_back(c);
    }
  }
  return parts;
}

std::optional<double> NumberFrom(const std::string& word) {
  double value = 0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failure != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
    return {};
  return value;
}

pipeline::ScalePoint PointFrom(const DtrSet& set, const std::string& text,
                               const std::string& whole) {
  pipeline::ScalePoint point{text, {}};
  for (const std::string& part : Split(text, '+')) {
    const auto words = Split(part, ':');
    if (words.front().empty()) Refuse(whole, "a view without a name");
    pipeline::ScaleClick click{FindView(set, words.front()).id, {}};
    if (words.size() == 3) {
      const auto x = NumberFrom(words[1]), y = NumberFrom(words[2]);
      if (!x || !y) Refuse(whole, fmt::format("no pixel is '{}:{}'", words[1], words[2]));
      click.pixel = Eigen::Vector2d(*x, *y);
    } else if (words.size() != 1) {
      Refuse(whole, fmt::format("no point is '{}'", part));
    }
    point.clicks.push_back(std::move(click));
  }
  return point;
}

double MetresFrom(const std::string& word, const std::string& whole) {
  const auto length = calib::LengthFrom(word);
  if (!length || !length->has_unit) Refuse(whole, fmt::format("no length is '{}'", word));
  return length->value;
}

pipeline::ScaleDistance DistanceFrom(const DtrSet& set, const std::string& text) {
  const size_t equals = text.rfind('=');
  if (equals == std::string::npos) Refuse(text, "found no '='");
  const auto points = Split(text.substr(0, equals), ',');
  if (points.size() != 2) Refuse(text, fmt::format("found {} points", points.size()));
  pipeline::ScaleDistance distance;
  distance.text = text;
  distance.a = PointFrom(set, points[0], text);
  distance.b = PointFrom(set, points[1], text);
  const std::string length = text.substr(equals + 1);
  const size_t spread = length.find("+-");
  distance.length_m = MetresFrom(length.substr(0, spread), text);
  if (spread != std::string::npos) distance.sigma_m = MetresFrom(length.substr(spread + 2), text);
  return distance;
}

calib::Board MetricBoard(const std::string& text) {
  const calib::Board board = calib::BoardFromText(text);
  if (board.metric) return board;
  throw UsageError(fmt::format(
      "--board {}: expected a square in mm, cm or m, found a length without a unit", text));
}

int RunScale(Options options, const Context& context) {
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
    options.scale.distances.push_back(DistanceFrom(set, text));
  }
  options.scale.threads = context.common.threads;
  const auto report = pipeline::ScaleSet(options.scale, context.console);
  for (const std::string& line : report.lines) context.console.Say(line);
  context.console.Say(fmt::format("{}: one unit was {:.6g} m +- {:.2g} %; the set is in metres now",
                                  report.written.string(), report.metres_per_unit,
                                  100 * report.relative_sigma));
  context.EmitJson(report.json);
  return kDone;
}

}  // namespace

void AddCalibrateScaleCommand(CLI::App& calibrate) {
  AddCommand(calibrate, "scale", "Give a set its size in metres",
             "dtr calibrate scale scene.dtr --distance 0001:640:410,0001:902:398=2.5m",
             [](CLI::App& command) -> Action {
               auto options = std::make_shared<Options>();
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
                               "Folder of the set's photos, whose EXIF says where they were taken")
                   ->check(CLI::ExistingDirectory)
                   ->type_name("PHOTOS");
               command.add_flag("--force", scale.force, "Replace SET2 when it exists");
               return [options](const Context& context) { return RunScale(*options, context); };
             });
}

}  // namespace dtr::cli
