#include "calib/validation/report_json.h"

#include "dtr/base/json_number.h"

namespace dtr::calib {

nlohmann::ordered_json JsonOf(const ResidualStats& stats) {
  const auto number = [any = stats.count > 0](double value) {
    return any ? NumberOrNull(value) : nlohmann::ordered_json(nullptr);
  };
  return {{"count", stats.count},
          {"rms_px", number(stats.rms_px)},
          {"median_px", number(stats.median_px)},
          {"p95_px", number(stats.p95_px)},
          {"worst_px", number(stats.worst_px)},
          {"mean_x_px", number(stats.mean_px.x())},
          {"mean_y_px", number(stats.mean_px.y())}};
}

}  // namespace dtr::calib
