#include "cli/metre_options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "calib/boards/length.h"
#include "dtr/base/error.h"

namespace dtr::cli {
namespace {

// A word of --distance, and what its ends may be.
struct Typed {
  const std::string& text;
  DistanceEnds ends;
};

[[noreturn]] void Reject(const Typed& typed, const std::string& what) {
  const char* form =
      typed.ends == DistanceEnds::kCameras
          ? "left01,right01=12cm: A and B each a photo, whose camera is meant"
          : "0001:640:410,0001:902.5:398=2.5m: A and B each VIEW:X:Y, VIEW:X:Y+VIEW2:X:Y or VIEW "
            "(the camera itself)";
  throw UsageError(
      fmt::format("--distance {}: {}; expected A,B=LENGTH, as {}, LENGTH in mm, cm or m",
                  typed.text, what, form));
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

pipeline::ScalePoint PointFrom(const std::string& text, const Typed& whole) {
  pipeline::ScalePoint point{text, {}};
  if (whole.ends == DistanceEnds::kCameras) {
    if (text.empty()) Reject(whole, "a photo without a name");
    point.clicks.push_back({text, {}});  // with all its signs: photos may have them in their names
    return point;
  }
  for (const std::string& part : Split(text, '+')) {
    const auto words = Split(part, ':');
    if (words.front().empty()) Reject(whole, "a view without a name");
    pipeline::ScaleClick click{words.front(), {}};
    if (words.size() == 3) {
      const auto x = NumberFrom(words[1]), y = NumberFrom(words[2]);
      if (!x || !y) Reject(whole, fmt::format("no pixel is '{}:{}'", words[1], words[2]));
      click.pixel = Eigen::Vector2d(*x, *y);
    } else if (words.size() != 1) {
      Reject(whole, fmt::format("no point is '{}'", part));
    }
    point.clicks.push_back(std::move(click));
  }
  return point;
}

double MetresFrom(const std::string& word, const Typed& whole) {
  const auto length = calib::LengthFrom(word);
  if (!length || !length->has_unit) Reject(whole, fmt::format("no length is '{}'", word));
  return length->value;
}

pipeline::GpsSigma GpsSigmaFrom(const std::string& text) {
  const auto words = Split(text, ',');
  const auto flat = NumberFrom(words.front()), up = NumberFrom(words.back());
  if (words.size() > 2 || !flat || !up || !(*flat > 0) || !(*up > 0)) {
    throw UsageError(fmt::format(
        "--gps-sigma {}: expected metres above 0, as 3 or 3,6 (on the map, in height)", text));
  }
  return {*flat, *up};
}

}  // namespace

pipeline::ScaleDistance DistanceFrom(const std::string& text, DistanceEnds ends) {
  const Typed typed{text, ends};
  const size_t equals = text.rfind('=');
  if (equals == std::string::npos) Reject(typed, "found no '='");
  const auto points = Split(text.substr(0, equals), ',');
  if (points.size() != 2) Reject(typed, fmt::format("found {} ends", points.size()));
  pipeline::ScaleDistance distance;
  distance.text = text;
  distance.a = PointFrom(points[0], typed);
  distance.b = PointFrom(points[1], typed);
  const std::string length = text.substr(equals + 1);
  const size_t spread = length.find("+-");
  distance.length_m = MetresFrom(length.substr(0, spread), typed);
  if (spread != std::string::npos) distance.sigma_m = MetresFrom(length.substr(spread + 2), typed);
  return distance;
}

CLI::Option* AddGpsFlag(CLI::App& command, bool& gps) {
  return command.add_flag(
      "--gps", gps,
      "Constrain cameras to the photos' EXIF positions: metres east, north, up; positions that do "
      "not determine the scale orient what --distance scales");
}

CLI::Option* AddMetreOptions(CLI::App& command, CLI::Option& gps, MetreWords& words) {
  command
      .add_option_function<std::string>(
          "--gps-sigma", [&words](const std::string& word) { words.gps_sigma = word; },
          "Standard deviation of GPS positions per axis, on the map and in height, instead of what "
          "EXIF gives or the positions themselves show")
      ->needs(&gps)
      ->type_name("M[,V]");
  return command
      .add_option(
          "--distance", words.distances,
          "Measured distance between the cameras of photos A and B, as 2.5m or, with its standard "
          "deviation, 2.5m+-5mm; repeatable")
      ->type_name("A,B=LENGTH");
}

pipeline::MetreOptions MetreOptionsFrom(bool gps, const MetreWords& words) {
  pipeline::MetreOptions options;
  options.gps = gps;
  if (words.gps_sigma) options.gps_sigma = GpsSigmaFrom(*words.gps_sigma);
  for (const std::string& text : words.distances) {
    options.distances.push_back(DistanceFrom(text, DistanceEnds::kCameras));
  }
  return options;
}

}  // namespace dtr::cli
