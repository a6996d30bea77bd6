#include "calib/validation/report_json.h"
#include "dtr/types/check_json.h"

namespace dtr::calib {

using Json = nlohmann::ordered_json;

Json JsonOf(const ValidationReport& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = dtr::JsonOf(report.tests);
  json["cameras"] = Json::array();
  for (const CameraValidation& camera : report.cameras) {
    json["cameras"].push_back({{"name", camera.name},
                               {"held_out", JsonOf(camera.held_out)},
                               {"stored", JsonOf(camera.stored)},
                               {"short_tracks", camera.short_tracks},
                               {"weak_geometry", camera.weak_geometry},
                               {"impossible", camera.impossible}});
  }
  json["held_out"] = JsonOf(report.held_out);
  json["stored"] = JsonOf(report.stored);
  json["regions"] = Json::array();
  for (const ResidualStats& region : report.regions) json["regions"].push_back(JsonOf(region));
  json["untested"] = report.untested;
  json["kept_apart"] = report.kept_apart;
  return json;
}

std::string ToJson(const ValidationReport& report) {
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return JsonOf(report).dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
