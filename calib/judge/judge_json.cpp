#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/judge/judge.h"

namespace dtr::calib {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN: what was not measured is null.
Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json ToJsonValue(const ResidualStats& stats) {
  const auto number = [&](double value) { return stats.count > 0 ? Number(value) : Json(nullptr); };
  return {{"count", stats.count},
          {"rms_px", number(stats.rms_px)},
          {"median_px", number(stats.median_px)},
          {"p95_px", number(stats.p95_px)},
          {"worst_px", number(stats.worst_px)},
          {"mean_x_px", number(stats.mean_px.x())},
          {"mean_y_px", number(stats.mean_px.y())}};
}

Json ToJsonValue(const std::vector<Check>& tests) {
  Json json = Json::array();
  for (const Check& test : tests) {
    json.push_back({{"name", test.name},
                    {"value", Number(test.value)},
                    {"limit", Number(test.limit)},
                    {"passed", test.passed},
                    {"reason", test.reason}});
  }
  return json;
}

Json ToJsonValue(const ImageMap& map) {
  return {{"largest", Number(map.Largest())}, {"median", Number(map.Median())}};
}

}  // namespace

std::string ToJson(const JudgeReport& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = ToJsonValue(report.tests);
  json["cameras"] = Json::array();
  for (const JudgedCamera& camera : report.cameras) {
    Json item{{"name", camera.name},
              {"stored", ToJsonValue(camera.stored)},
              {"held_out", ToJsonValue(camera.held_out)},
              {"noise_px", Number(camera.noise_px)},
              {"coverage", camera.coverage},
              {"board_distance", Number(camera.distance)},
              {"uncertainty_px", ToJsonValue(camera.near_uncertainty)},
              {"far_uncertainty_px", ToJsonValue(camera.far_uncertainty)},
              {"difference_px", ToJsonValue(camera.difference)}};
    item["regions"] = Json::array();
    for (const auto& region : camera.regions) item["regions"].push_back(ToJsonValue(region));
    item["views"] = Json::array();
    for (const JudgedView& view : camera.views) {
      item["views"].push_back({{"name", view.name},
                               {"rms_px", Number(view.rms_px)},
                               {"worst_px", Number(view.worst_px)},
                               {"corners", view.corners},
                               {"outliers", view.outliers}});
    }
    json["cameras"].push_back(std::move(item));
  }
  json["unseen"] = report.unseen;
  json["sigma_px"] = Number(report.sigma_px);
  json["condition"] = Number(report.condition);
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
