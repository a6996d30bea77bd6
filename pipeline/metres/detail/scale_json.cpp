#include "pipeline/metres/detail/scale_json.h"

#include <nlohmann/json.hpp>

#include "dtr/types/dtr_set.h"
#include "pipeline/core/reports/metres_json.h"
#include "pipeline/core/reports/text.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json BoardJson(const ScaledByBoard& board) {
  Json json{{"method", "board"},
            {"board", board.board},
            {"views", board.scale.views},
            {"corners", board.scale.corners},
            {"outliers", board.scale.outliers},
            {"rms_px", board.scale.rms_px},
            {"left_out", Json::array()}};
  for (const calib::LeftOut& item : board.scale.left_out) {
    json["left_out"].push_back({{"name", item.name}, {"reason", item.reason}});
  }
  return json;
}

Json PositionsJson(const ScaledByPositions& positions) {
  Json json{{"method", "gps"},
            {"photos", positions.photos},
            {"left_out", positions.left_out},
            {"settled", positions.settled},
            {"rms_m", positions.rms_m},
            {"turn_sigma_deg", positions.turn_sigma_deg},
            {"axes", positions.origin ? "east, north, up" : "as before"}};
  if (positions.origin) json["origin"] = OriginJson(*positions.origin);
  return json;
}

}  // namespace

Json ScaleMethodJson(const ScaleReport& report) {
  if (report.board) return BoardJson(*report.board);
  if (report.positions) return PositionsJson(*report.positions);
  Json json{{"method", "distance"}, {"distances", Json::array()}};
  for (const ScaledDistance& d : report.distances) {
    json["distances"].push_back({{"text", d.text},
                                 {"units", d.units},
                                 {"length_m", d.length_m},
                                 {"sigmas_off", d.sigmas_off}});
  }
  return json;
}

Json ScaleJson(const ScaleReport& report) {
  Json json{{"metres_per_unit", report.metres_per_unit}, {"relative_sigma", report.relative_sigma}};
  json.update(ScaleMethodJson(report));
  return json;
}

std::string ToJson(const ScaleReport& report) {
  Json json = ScaleJson(report);
  json["set"] = report.written.string();
  json["unit"] = NameOf(LengthUnit::kMetre);
  return Text(json);
}

}  // namespace dtr::pipeline
