#include "pipeline/core/metres.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "calib/scale.h"
#include "dtr/base/error.h"
#include "dtr/types/photo_names.h"

namespace dtr::pipeline {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// The photo that an end of the distance is called by.
std::optional<size_t> FindPhoto(const std::vector<std::string>& names,
                                const ScaleDistance& distance, const ScalePoint& end) {
  const std::vector<size_t> called = PhotosCalled(names, end.text);
  if (called.empty()) return std::nullopt;
  if (called.size() == 1) return called.front();
  throw UsageError(
      fmt::format("`distance` {}: '{}' may be {} or {}; name the photo with its extension",
                  distance.text, end.text, names[called[0]], names[called[1]]));
}

calib::KnownMetres KnownOf(const calib::SfmModel& model, const MetreOptions& options,
                           const PhotoPositions& places) {
  calib::KnownMetres known;
  known.max_passes = options.max_passes;
  std::map<std::string, int> image_of;
  for (const calib::SfmImage& image : model.images) {
    image_of.emplace(image.name, static_cast<int>(image_of.size()));
  }
  const std::vector<Eigen::Vector3d> positions_m = places.EastNorthUp();
  for (size_t i = 0; options.gps && i < places.names.size(); ++i) {
    calib::KnownPlace place{image_of.at(places.names[i]), positions_m[i], 0, 0};
    if (const auto& radius_m = places.places[i].horizontal_error_m) {
      place.sigma_flat_m = calib::SigmaOfRadius(*radius_m);
    }
    if (options.gps_sigma) {
      place.sigma_flat_m = options.gps_sigma->flat_m;
      place.sigma_up_m = options.gps_sigma->up_m;
    }
    known.places.push_back(place);
  }
  const std::vector<std::string> names = calib::ImageNames(model);
  for (const ScaleDistance& d : options.distances) {
    calib::KnownDistance distance{"`distance` " + d.text, 0, 0, d.length_m, d.sigma_m};
    for (const auto& [point, image] :
         {std::pair(&d.a, &distance.image_a), std::pair(&d.b, &distance.image_b)}) {
      const auto found = FindPhoto(names, d, *point);
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

// Which way is up is known worse than kMaxTurnSigmaRad.
std::string TurnLine(const calib::MetricReport& report) {
  constexpr double kNoTurnSigmaRad = 1;  // beyond, an error of a turn is no small number any more
  const std::string known =
      report.turn_sigma_rad < kNoTurnSigmaRad
          ? fmt::format("is known to {:.0f} degrees only", report.turn_sigma_rad / kDegree)
          : "is not known";
  // No axis is known better than the scale: the arms about it are no longer.
  if (report.places_relative_sigma > calib::kMaxTurnSigmaRad) {
    return "the positions err too much for cameras that stand so near to each other: the rotation, "
           "and "
           "with it what is north and up, " +
           known;
  }
  return "the cameras stand nearly on a line: the rotation about it, and with it what is up, " +
         known;
}

PositionsReport ReportOf(const calib::SfmModel& model, const PhotoPositions& places,
                         const calib::MetricReport& report) {
  std::vector<std::string> left_out;
  for (const int i : report.left_out) {
    left_out.push_back(model.images[static_cast<size_t>(i)].name);
  }
  return {.photos = static_cast<int>(places.names.size()),
          .left_out = std::move(left_out),
          .given_rms_m = report.given_rms_m,
          .rms_m = report.rms_m,
          .found_sigma_flat_m = report.sigma_flat_m,
          .found_sigma_up_m = report.sigma_up_m,
          .determine_scale = report.places_tell_scale,
          .relative_sigma = report.places_relative_sigma,
          .passes = report.passes,
          .settled = report.settled,
          .turn_sigma_deg = report.turn_sigma_rad / kDegree,
          .origin = places.places[places.Origin()]};
}

void TellOfPlaces(const PhotoPositions& places, const calib::MetricReport& report,
                  RefinedInMetres& out) {
  const std::vector<std::string>& left_out = out.report.positions->left_out;
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
  if (!report.settled) {
    out.lines.push_back(fmt::format(
        "which positions agree, and how far they err, did not settle in {} passes; give "
        "`gps_sigma` where you know it",
        report.passes));
  }
  if (!report.places_tell_scale) {
    out.lines.push_back(fmt::format(
        "the positions alone determine the scale to {:.0f} % only: it is that of the distances, "
        "and they rotate and translate the whole",
        100 * report.places_relative_sigma));
  }
  out.lines.push_back(places.AxesLine());
  if (!(report.turn_sigma_rad <= calib::kMaxTurnSigmaRad)) {
    out.lines.push_back(TurnLine(report));
  }
}

void TellOfDistances(const std::vector<DistanceReport>& distances, RefinedInMetres& out) {
  for (const DistanceReport& d : distances) {
    out.lines.push_back(
        fmt::format("{}: {:.6g} m in the model as a whole, {:.6g} m as adjusted, {:.2f} standard "
                    "deviations off",
                    d.text, d.given_m, d.found_m, d.sigmas_off));
  }
}

}  // namespace

void RequireCameras(const MetreOptions& options, const std::vector<std::string>& names,
                    const std::string& whose) {
  for (const ScaleDistance& d : options.distances) {
    for (const ScalePoint* point : {&d.a, &d.b}) {
      if (FindPhoto(names, d, *point)) continue;
      if (point->text.find_first_of(":+") != std::string::npos) {
        throw UsageError(fmt::format(
            "`distance` {}: expected two photos, as left01,right01=12cm, found '{}'; points of "
            "images are for dtr calibrate scale, of a finished set",
            d.text, point->text));
      }
      throw UsageError(fmt::format("`distance` {}: no photo is named '{}'; {} has {} ... ({})",
                                   d.text, point->text, whose, names.empty() ? "" : names.front(),
                                   names.size()));
    }
    if (FindPhoto(names, d, d.a) == FindPhoto(names, d, d.b)) {
      throw UsageError(
          fmt::format("`distance` {}: expected two photos, found '{}' twice", d.text, d.a.text));
    }
  }
}

void RequireMetres(const MetreOptions& options, const capture::Capture& photos,
                   const std::string& where, const std::vector<bool>& held_back) {
  std::vector<std::string> names, adjusted;
  for (const capture::Photo& photo : photos.photos) {
    if (held_back.empty() || !held_back[names.size()]) adjusted.push_back(photo.name);
    names.push_back(photo.name);
  }
  RequireCameras(options, names, where);
  for (const ScaleDistance& d : options.distances) {
    for (const ScalePoint* end : {&d.a, &d.b}) {
      const std::string& name = names[*FindPhoto(names, d, *end)];
      if (std::find(adjusted.begin(), adjusted.end(), name) != adjusted.end()) continue;
      throw UsageError(fmt::format(
          "`distance` {}: expected photos that take part in bundle adjustment, found {}, which "
          "`holdout_strict` keeps out of it; name others, or leave out `holdout_strict`",
          d.text, name));
    }
  }
  if (!options.gps) return;
  RequirePlaces(PhotoPositionsOf(photos, adjusted), where,
                adjusted.size() == names.size() ? "the folder" : "those not held out strictly");
}

RefinedInMetres RefineInMetres(const calib::SfmModel& model, const MetreOptions& options,
                               const PhotoPositions& places, const calib::RefineOptions& refine) {
  const calib::KnownMetres known = KnownOf(model, options, places);
  RefinedInMetres out;
  out.start = calib::StartInMetres(model, known, refine);
  out.refined = calib::RefineInMetres(known, out.start);
  const calib::MetricReport& report = out.start.report;
  out.report.metres_per_unit = report.metres_per_unit;
  out.report.relative_sigma = report.relative_sigma;
  if (options.gps) {
    out.report.positions = ReportOf(model, places, report);
    TellOfPlaces(places, report, out);
  }
  for (size_t i = 0; i < options.distances.size(); ++i) {
    out.report.distances.push_back({.text = options.distances[i].text,
                                    .length_m = options.distances[i].length_m,
                                    .given_m = report.given_m[i],
                                    .found_m = report.found_m[i],
                                    .sigmas_off = report.sigmas_off[i]});
  }
  TellOfDistances(out.report.distances, out);
  out.lines.push_back(fmt::format("one unit was {:.6g} m +- {:.2g} %; lengths are in metres now",
                                  report.metres_per_unit, 100 * report.relative_sigma));
  return out;
}

}  // namespace dtr::pipeline
