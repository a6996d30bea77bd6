#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/validate.h"

namespace dtr::calib {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN: what was not measured is null.
Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json ToJsonValue(const ResidualStats& stats) {
  const bool any = stats.count > 0;
  const auto number = [any](double value) { return any ? Number(value) : Json(nullptr); };
  return {{"count", stats.count},
          {"rms_px", number(stats.rms_px)},
          {"median_px", number(stats.median_px)},
          {"p95_px", number(stats.p95_px)},
          {"worst_px", number(stats.worst_px)},
          {"mean_x_px", number(stats.mean_px.x())},
          {"mean_y_px", number(stats.mean_px.y())}};
}

}  // namespace

std::string ToJson(const ValidationReport& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = Json::array();
  for (const Check& test : report.tests) {
    json["tests"].push_back({{"name", test.name},
                             {"value", Number(test.value)},
                             {"limit", Number(test.limit)},
                             {"passed", test.passed},
                             {"reason", test.reason}});
  }
  json["cameras"] = Json::array();
  for (const CameraValidation& camera : report.cameras) {
    json["cameras"].push_back({{"name", camera.name},
                               {"held_out", ToJsonValue(camera.held_out)},
                               {"stored", ToJsonValue(camera.stored)},
                               {"short_tracks", camera.short_tracks},
                               {"weak_geometry", camera.weak_geometry},
                               {"impossible", camera.impossible}});
  }
  json["held_out"] = ToJsonValue(report.held_out);
  json["stored"] = ToJsonValue(report.stored);
  json["regions"] = Json::array();
  for (const ResidualStats& region : report.regions) {
    json["regions"].push_back(ToJsonValue(region));
  }
  json["untested"] = report.untested;
  if (!report.adjustment_json.empty()) json["adjustment"] = Json::parse(report.adjustment_json);
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
