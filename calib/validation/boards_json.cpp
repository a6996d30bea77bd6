#include <nlohmann/json.hpp>

#include "calib/validation/boards.h"
#include "calib/validation/report_json.h"

namespace dtr::calib {
namespace {

using Json = nlohmann::ordered_json;

Json ToJsonValue(const ImageMap& map) {
  return {{"largest", NumberOrNull(map.Largest())},
          {"p95", NumberOrNull(map.Quantile(0.95))},
          {"median", NumberOrNull(map.Median())}};
}

}  // namespace

std::string ToJson(const BoardValidation& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = ToJsonValue(report.tests);
  json["cameras"] = Json::array();
  RotationCounts rotated;
  for (const ValidatedCamera& camera : report.cameras) {
    Json item{{"name", camera.name},
              {"stored", ToJsonValue(camera.stored)},
              {"held_out", ToJsonValue(camera.held_out)},
              {"noise_px", NumberOrNull(camera.noise_px)},
              {"coverage", camera.coverage},
              {"board_distance", NumberOrNull(camera.distance)},
              {"uncertainty_px", ToJsonValue(camera.near_uncertainty)},
              {"far_uncertainty_px", ToJsonValue(camera.far_uncertainty)},
              {"difference_px", ToJsonValue(camera.difference)},
              {"model_spread_px", ToJsonValue(camera.model_spread)},
              {"spread_model", camera.spread_model}};
    item["uncertainty_at"] = Json::array();
    for (const UncertaintyAt& at : camera.uncertainty_at) {
      item["uncertainty_at"].push_back({{"distance", at.distance}});
      item["uncertainty_at"].back().update(ToJsonValue(at.map));
    }
    item["regions"] = Json::array();
    for (const auto& region : camera.regions) item["regions"].push_back(ToJsonValue(region));
    item["views"] = Json::array();
    for (const ValidatedView& view : camera.views) {
      item["views"].push_back({{"name", view.name},
                               {"rms_px", NumberOrNull(view.rms_px)},
                               {"worst_px", NumberOrNull(view.worst_px)},
                               {"corners", view.corners},
                               {"outliers", view.outliers}});
      if (view.rotation == PhotoRotation::kNone) continue;
      item["views"].back()["photo_rotation_deg"] = DegreesOf(view.rotation);
      rotated.Add(view.rotation);
    }
    json["cameras"].push_back(std::move(item));
  }
  json["rotated_photos"] = {{"clockwise", rotated.clockwise},
                            {"counterclockwise", rotated.counterclockwise}};
  json["test_photos"] = report.test_views;
  json["flipped"] = report.flipped;
  json["sigma_px"] = NumberOrNull(report.sigma_px);
  json["condition"] = NumberOrNull(report.condition);
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
