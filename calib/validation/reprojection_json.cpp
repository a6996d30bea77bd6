#include <nlohmann/json.hpp>

#include "calib/validation/report_json.h"
#include "calib/validation/reprojection.h"

namespace dtr::calib {

using Json = nlohmann::ordered_json;

std::string ToJson(const ValidationReport& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = ToJsonValue(report.tests);
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
  json["kept_apart"] = report.kept_apart;
  if (!report.adjustment_json.empty()) json["adjustment"] = Json::parse(report.adjustment_json);
  if (!report.cross_depth_json.empty()) {
    json["cross_depth"] = Json::parse(report.cross_depth_json);
    for (const char* told_above : {"passed", "tests"}) json["cross_depth"].erase(told_above);
  }
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
