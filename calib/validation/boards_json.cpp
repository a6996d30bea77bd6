#include "calib/validation/conclusion.h"
#include "calib/validation/report_json.h"
#include "dtr/types/check_json.h"

namespace dtr::calib {
namespace {

using Json = nlohmann::ordered_json;

Json JsonOf(const ImageMap& map) {
  return {{"largest", NumberOrNull(map.Largest())},
          {"p95", NumberOrNull(map.Quantile(0.95))},
          {"median", NumberOrNull(map.Median())}};
}

}  // namespace

Json JsonOf(const BoardValidation& report) {
  Json json;
  json["passed"] = report.passed();
  json["result"] = ResultWord(report.passed());
  json["conclusion"] = Conclusion(report.tests, Validated::kBoards);
  json["tests"] = dtr::JsonOf(report.tests);
  json["cameras"] = Json::array();
  RotationCounts rotated;
  for (const ValidatedCamera& camera : report.cameras) {
    Json item{{"name", camera.name},
              {"stored", JsonOf(camera.stored)},
              {"held_out", JsonOf(camera.held_out)},
              {"noise_px", NumberOrNull(camera.noise_px)},
              {"coverage", camera.coverage},
              {"board_distance", NumberOrNull(camera.distance)},
              {"uncertainty_px", JsonOf(camera.near_uncertainty)},
              {"far_uncertainty_px", JsonOf(camera.far_uncertainty)},
              {"difference_px", JsonOf(camera.difference)},
              {"model_spread_px", JsonOf(camera.model_spread)},
              {"spread_model", camera.spread_model}};
    item["uncertainty_at"] = Json::array();
    for (const UncertaintyAt& at : camera.uncertainty_at) {
      item["uncertainty_at"].push_back({{"distance", at.distance}});
      item["uncertainty_at"].back().update(JsonOf(at.map));
    }
    item["regions"] = Json::array();
    for (const auto& region : camera.regions) item["regions"].push_back(JsonOf(region));
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
  return json;
}

std::string ToJson(const BoardValidation& report) {
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return JsonOf(report).dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
