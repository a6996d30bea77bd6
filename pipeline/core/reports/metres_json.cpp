#include "pipeline/core/reports/metres_json.h"

#include <nlohmann/json.hpp>

#include "dtr/base/json_number.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

// 0: every position stated how far it errs.
Json FoundSigma(double sigma_m) { return sigma_m > 0 ? Json(sigma_m) : Json(); }
double FoundSigmaFrom(const Json& json) { return json.is_null() ? 0 : json.get<double>(); }

void AppendPositions(const PositionsReport& positions, Json& json) {
  json["photos"] = positions.photos;
  json["left_out"] = positions.left_out;
  json["given_rms_m"] = positions.given_rms_m;
  json["rms_m"] = positions.rms_m;
  json["found_sigma_flat_m"] = FoundSigma(positions.found_sigma_flat_m);
  json["found_sigma_up_m"] = FoundSigma(positions.found_sigma_up_m);
  json["places_tell_scale"] = positions.determine_scale;
  json["places_relative_sigma"] = positions.relative_sigma;
  json["passes"] = positions.passes;
  json["settled"] = positions.settled;
  json["turn_sigma_deg"] = positions.turn_sigma_deg;
  json["axes"] = "east, north, up";
  json["origin"] = OriginJson(positions.origin);
}

PositionsReport PositionsFrom(const Json& json) {
  PositionsReport positions;
  positions.photos = json.at("photos").get<int>();
  positions.left_out = json.at("left_out").get<std::vector<std::string>>();
  positions.given_rms_m = NumberOrNan(json.at("given_rms_m"));
  positions.rms_m = NumberOrNan(json.at("rms_m"));
  positions.found_sigma_flat_m = FoundSigmaFrom(json.at("found_sigma_flat_m"));
  positions.found_sigma_up_m = FoundSigmaFrom(json.at("found_sigma_up_m"));
  positions.determine_scale = json.at("places_tell_scale").get<bool>();
  positions.relative_sigma = NumberOrNan(json.at("places_relative_sigma"));
  positions.passes = json.at("passes").get<int>();
  positions.settled = json.at("settled").get<bool>();
  positions.turn_sigma_deg = NumberOrNan(json.at("turn_sigma_deg"));
  const Json& origin = json.at("origin");
  positions.origin.latitude_deg = origin.at("latitude_deg").get<double>();
  positions.origin.longitude_deg = origin.at("longitude_deg").get<double>();
  positions.origin.altitude_m = origin.at("altitude_m").get<double>();
  return positions;
}

const char* MethodOf(const MetreReport& report) {
  if (!report.positions) return "distance";
  return report.distances.empty() ? "gps" : "gps and distance";
}

}  // namespace

Json OriginJson(const io::GpsPosition& origin) {
  return {{"latitude_deg", origin.latitude_deg},
          {"longitude_deg", origin.longitude_deg},
          {"altitude_m", *origin.altitude_m}};
}

Json JsonOf(const MetreOptions& options) {
  Json json;
  json["gps"] = options.gps;
  if (options.gps_sigma) {
    json["gps_sigma_m"] = {options.gps_sigma->flat_m, options.gps_sigma->up_m};
  }
  json["distances"] = Json::array();
  for (const ScaleDistance& d : options.distances) json["distances"].push_back(d.text);
  return json;
}

Json JsonOf(const MetreReport& report) {
  Json json{{"metres_per_unit", report.metres_per_unit},
            {"relative_sigma", report.relative_sigma},
            {"method", MethodOf(report)},
            {"bundle_adjustment", true}};
  if (report.positions) AppendPositions(*report.positions, json);
  for (const DistanceReport& d : report.distances) {
    json["distances"].push_back({{"text", d.text},
                                 {"length_m", d.length_m},
                                 {"given_m", d.given_m},
                                 {"found_m", d.found_m},
                                 {"sigmas_off", d.sigmas_off}});
  }
  return json;
}

MetreReport MetreReportFrom(const Json& json) {
  MetreReport report;
  report.metres_per_unit = NumberOrNan(json.at("metres_per_unit"));
  report.relative_sigma = NumberOrNan(json.at("relative_sigma"));
  if (json.contains("photos")) report.positions = PositionsFrom(json);
  if (!json.contains("distances")) return report;
  for (const Json& item : json["distances"]) {
    report.distances.push_back({.text = item.at("text").get<std::string>(),
                                .length_m = NumberOrNan(item.at("length_m")),
                                .given_m = NumberOrNan(item.at("given_m")),
                                .found_m = NumberOrNan(item.at("found_m")),
                                .sigmas_off = NumberOrNan(item.at("sigmas_off"))});
  }
  return report;
}

}  // namespace dtr::pipeline
