#include "calib/validation/report_json.h"

#include <cmath>

namespace dtr::calib {

using Json = nlohmann::ordered_json;

Json NumberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json ToJsonValue(const ResidualStats& stats) {
  const bool any = stats.count > 0;
  const auto number = [any](double value) { return any ? NumberOrNull(value) : Json(nullptr); };
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
                    {"value", NumberOrNull(test.value)},
                    {"limit", NumberOrNull(test.limit)},
                    {"passed", test.passed},
                    {"reason", test.reason}});
  }
  return json;
}

}  // namespace dtr::calib
