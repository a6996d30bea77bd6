#include "cli/pipeline/known_metres.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calib/scale.h"
#include "dtr/base/error.h"
#include "dtr/types/view.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;

// The photo that somebody called `word`.
std::optional<size_t> FindPhoto(const std::vector<std::string>& names, const std::string& word) {
  const auto found = std::find_if(names.begin(), names.end(),
                                  [&](const std::string& name) { return IsCalled(name, word); });
  if (found == names.end()) return std::nullopt;
  return static_cast<size_t>(found - names.begin());
}

calib::KnownMetres KnownOf(const calib::SfmModel& model, const MetreOptions& options,
                           const PhotoPlaces& places) {
  calib::KnownMetres known;
  std::map<std::string, int> image_of;
  for (const calib::SfmImage& image : model.images) {
    image_of.emplace(image.name, static_cast<int>(image_of.size()));
  }
  const std::vector<Eigen::Vector3d> positions_m = places.EastNorthUp();
  for (size_t i = 0; options.gps && i < places.names.size(); ++i) {
    calib::KnownPlace place{image_of.at(places.names[i]), positions_m[i], 0, 0};
    place.sigma_flat_m = places.places[i].horizontal_error_m.value_or(0);
    if (options.gps_sigma) {
      place.sigma_flat_m = options.gps_sigma->flat_m;
      place.sigma_up_m = options.gps_sigma->up_m;
    }
    known.places.push_back(place);
  }
  const std::vector<std::string> names = calib::ImageNames(model);
  for (const ScaleDistance& d : options.distances) {
    calib::KnownDistance distance{"--distance " + d.text, 0, 0, d.length_m, d.sigma_m};
    for (const auto& [point, image] :
         {std::pair(&d.a, &distance.image_a), std::pair(&d.b, &distance.image_b)}) {
      const auto found = FindPhoto(names, point->text);
      if (!found) {
        throw Error(fmt::format("{}: expected two photos that have a camera, found none of {}",
                                distance.name, point->text));
      }
      *image = static_cast<int>(*found);
    }
    known.distances.push_back(distance);
  }
  return known;
}

void TellOfPlaces(const calib::SfmModel& model, const PhotoPlaces& places,
                  const calib::MetricReport& report, RefinedInMetres& out, Json& scale) {
  std::vector<std::string> left_out;
  for (const int i : report.left_out) {
    left_out.push_back(model.images[static_cast<size_t>(i)].name);
  }
  const double turn_deg = report.turn_sigma_rad / kDegree;
  scale["photos"] = places.names.size();
  scale["left_out"] = left_out;
  scale["given_rms_m"] = report.given_rms_m;
  scale["rms_m"] = report.rms_m;
  scale["found_sigma_flat_m"] = report.sigma_flat_m > 0 ? Json(report.sigma_flat_m) : Json();
  scale["found_sigma_up_m"] = report.sigma_up_m > 0 ? Json(report.sigma_up_m) : Json();
  scale["turn_sigma_deg"] = turn_deg;
  scale["axes"] = "east, north, up";
  scale["origin"] = Json::parse(places.OriginJson());
  out.lines = places.without_place;
  out.lines.push_back(fmt::format(
      "{} positions: {:.2f} m RMS of the model as a whole, {:.2f} m as adjusted to them",
      places.names.size() - left_out.size(), report.given_rms_m, report.rms_m));
  if (report.sigma_flat_m > 0) {
    out.lines.push_back(
        fmt::format("found that they err by {:.2f} m per axis on the map", report.sigma_flat_m));
  }
  if (report.sigma_up_m > 0) {
    out.lines.push_back(
        fmt::format("found that they err by {:.2f} m in height", report.sigma_up_m));
  }
  if (!left_out.empty()) {
    out.lines.push_back(fmt::format("do not agree, left out: {}", fmt::join(left_out, ", ")));
  }
  out.lines.push_back("axes: x east, y north, z up, from the first photo's place");
  if (!(report.turn_sigma_rad <= calib::kMostTurnSigmaRad)) {
    out.lines.push_back(
        fmt::format("the cameras stand nearly on a line: the turn about it, and "
                    "with it what is up, is known to {:.0f} degrees only",
                    turn_deg));
  }
}

void TellOfDistances(const MetreOptions& options, const calib::MetricReport& report,
                     RefinedInMetres& out, Json& scale) {
  scale["distances"] = Json::array();
  for (size_t i = 0; i < options.distances.size(); ++i) {
    const ScaleDistance& d = options.distances[i];
    scale["distances"].push_back({{"text", d.text},
                                  {"length_m", d.length_m},
                                  {"given_m", report.given_m[i]},
                                  {"found_m", report.found_m[i]},
                                  {"sigmas_off", report.sigmas_off[i]}});
    out.lines.push_back(
        fmt::format("{}: {:.6g} m in the model as a whole, {:.6g} m as adjusted, {:.2f} standard "
                    "deviations off",
                    d.text, report.given_m[i], report.found_m[i], report.sigmas_off[i]));
  }
}

}  // namespace

void RequireCameras(const MetreOptions& options, const std::vector<std::string>& names,
                    const std::string& whose) {
  for (const ScaleDistance& d : options.distances) {
    for (const ScalePoint* point : {&d.a, &d.b}) {
      if (point->clicks.size() != 1 || point->clicks.front().pixel) {
        throw UsageError(fmt::format(
            "--distance {}: expected two photos, as left01,right01=12cm, found '{}'; points of "
            "pictures are for dtr calibrate scale, of a finished set",
            d.text, point->text));
      }
      if (FindPhoto(names, point->text)) continue;
      throw UsageError(fmt::format("--distance {}: no photo is named '{}'; {} has {} ... ({})",
                                   d.text, point->text, whose, names.empty() ? "" : names.front(),
                                   names.size()));
    }
    if (FindPhoto(names, d.a.text) == FindPhoto(names, d.b.text)) {
      throw UsageError(
          fmt::format("--distance {}: expected two photos, found '{}' twice", d.text, d.a.text));
    }
  }
}

void RequireMetres(const MetreOptions& options, const capture::Capture& photos,
                   const std::string& where) {
  std::vector<std::string> names;
  for (const capture::Photo& photo : photos.photos) names.push_back(photo.name);
  RequireCameras(options, names, where);
  if (options.gps) RequirePlaces(PhotoPlacesOf(photos, names), where, "the folder");
}

std::string ToJson(const MetreOptions& options) {
  Json json;
  json["gps"] = options.gps;
  if (options.gps_sigma) {
    json["gps_sigma_m"] = {options.gps_sigma->flat_m, options.gps_sigma->up_m};
  }
  json["distances"] = Json::array();
  for (const ScaleDistance& d : options.distances) json["distances"].push_back(d.text);
  return json.dump();
}

RefinedInMetres RefineInMetres(const calib::SfmModel& model, const MetreOptions& options,
                               const PhotoPlaces& places, const calib::RefineOptions& refine,
                               const std::string& determined) {
  const calib::KnownMetres known = KnownOf(model, options, places);
  RefinedInMetres out;
  out.start = calib::StartInMetres(model, known, refine);
  if (!determined.empty()) {
    calib::RequireDetermined(out.start.model, out.start.options, determined);
  }
  out.refined = calib::RefineInMetres(known, out.start);
  const calib::MetricReport& report = out.start.report;
  Json scale = {{"metres_per_unit", report.metres_per_unit},
                {"relative_sigma", report.relative_sigma}};
  scale["method"] = !options.gps                ? "distance"
                    : options.distances.empty() ? "gps"
                                                : "gps and distance";
  scale["bundle_adjustment"] = true;
  if (options.gps) TellOfPlaces(model, places, report, out, scale);
  if (!options.distances.empty()) TellOfDistances(options, report, out, scale);
  out.lines.push_back(fmt::format("one unit was {:.6g} m +- {:.2g} %; lengths are in metres now",
                                  report.metres_per_unit, 100 * report.relative_sigma));
  out.scale_json = scale.dump();
  Json json = Json::parse(calib::ToJson(out.refined));
  json["unit"] = "metre";
  json["scale"] = scale;
  out.json = json.dump();
  return out;
}

}  // namespace dtr::pipeline
