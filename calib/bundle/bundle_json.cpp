#include "calib/bundle/bundle_json.h"

#include <nlohmann/json.hpp>

#include "dtr/base/json_number.h"

namespace dtr::calib {
namespace {

using Json = nlohmann::ordered_json;

constexpr LensFreedom kFreedoms[] = {LensFreedom::kFixed,
                                     LensFreedom::kFocal,
                                     LensFreedom::kNoPrincipalPoint,
                                     LensFreedom::kAll,
                                     LensFreedom::kTangential,
                                     LensFreedom::kPrincipalPointPerImage,
                                     LensFreedom::kTangentialPerImage};

// Empty for "as given".
std::optional<LensFreedom> FreedomCalled(const std::string& name) {
  for (const LensFreedom freedom : kFreedoms) {
    if (name == NameOf(freedom)) return freedom;
  }
  return std::nullopt;
}

Json Rows(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (long i = 0; i < matrix.rows(); ++i) {
    rows.push_back(std::vector<double>(matrix.row(i).begin(), matrix.row(i).end()));
  }
  return rows;
}

}  // namespace

Json JsonOf(const CovarianceReport& report) {
  Json json;
  json["sigma_px"] = NumberOrNull(report.sigma_px);
  json["computed"] = report.computed;
  json["condition"] = report.computed ? NumberOrNull(report.condition) : Json(nullptr);
  json["gauge_freedom"] = report.computed ? Json(report.gauge_freedom) : Json(nullptr);
  json["determined"] = report.computed ? Json(report.determined) : Json(nullptr);
  json["lenses"] = Json::array();
  for (const LensCovariance& lens : report.lenses) {
    json["lenses"].push_back({{"names", lens.names}, {"matrix", Rows(lens.matrix)}});
  }
  json["cameras"] = Json::array();
  for (const PoseCovariance& camera : report.cameras) {
    json["cameras"].push_back({{"name", camera.name}, {"matrix", Rows(camera.matrix)}});
  }
  return json;
}

Json JsonOf(const RefineReport& report) {
  Json json;
  json["refined"] = report.changed;
  if (!report.reason.empty()) json["reason"] = report.reason;
  if (report.lens) json["lens"] = NameOf(*report.lens);
  json["held_out_observations"] = report.held_out_observations;
  json["given_px"] = report.given_px;
  json["adjusted_px"] = report.adjusted_px;
  json["candidates"] = Json::array();
  for (const RefineCandidate& c : report.candidates) {
    json["candidates"].push_back({{"name", c.name},
                                  {"held_out_px", c.held_out_px},
                                  {"low_px2", c.low_px2},
                                  {"high_px2", c.high_px2},
                                  {"principal_point_sigmas", c.principal_point_sigmas},
                                  {"converged", c.converged}});
    if (!c.undetermined.empty()) json["candidates"].back()["undetermined"] = c.undetermined;
  }
  if (report.changed) {
    json["sigma_px"] = report.solve.sigma_px;
    json["rms_px"] = report.solve.rms_px;
    json["iterations"] = report.solve.iterations;
    json["converged"] = report.solve.converged;
    json["unsettled_observations"] = report.solve.unsettled;
    json["points_dropped"] = report.points_dropped;
  }
  if (report.covariance) json["covariance"] = JsonOf(*report.covariance);
  return json;
}

RefineReport RefineReportFrom(const Json& json) {
  RefineReport report;
  report.changed = json.at("refined").get<bool>();
  report.reason = json.value("reason", "");
  if (json.contains("lens")) report.lens = FreedomCalled(json["lens"].get<std::string>());
  report.held_out_observations = json.at("held_out_observations").get<int>();
  report.given_px = NumberOrNan(json.at("given_px"));
  report.adjusted_px = NumberOrNan(json.at("adjusted_px"));
  for (const Json& item : json.at("candidates")) {
    RefineCandidate candidate;
    candidate.name = item.at("name").get<std::string>();
    candidate.lens = FreedomCalled(candidate.name);
    candidate.held_out_px = NumberOrNan(item.at("held_out_px"));
    candidate.low_px2 = NumberOrNan(item.at("low_px2"));
    candidate.high_px2 = NumberOrNan(item.at("high_px2"));
    candidate.principal_point_sigmas = NumberOrNan(item.at("principal_point_sigmas"));
    candidate.converged = item.at("converged").get<bool>();
    candidate.undetermined = item.value("undetermined", "");
    report.candidates.push_back(std::move(candidate));
  }
  if (!report.changed) return report;
  report.solve.sigma_px = NumberOrNan(json.at("sigma_px"));
  report.solve.rms_px = NumberOrNan(json.at("rms_px"));
  report.solve.iterations = json.at("iterations").get<int>();
  report.solve.converged = json.at("converged").get<bool>();
  report.solve.unsettled = json.at("unsettled_observations").get<int>();
  report.points_dropped = json.at("points_dropped").get<int>();
  return report;
}

Json JsonOf(const RigReport& report) {
  return {{"scale", report.scale},
          {"scale_spread", report.scale_spread},
          {"frames", report.frames},
          {"pairs", report.pairs},
          {"free_sigma_px", report.free_sigma_px},
          {"sigma_px", report.solve.sigma_px},
          {"rms_px", report.solve.rms_px},
          {"iterations", report.solve.iterations},
          {"points_dropped", report.points_dropped}};
}

RigReport RigReportFrom(const Json& json) {
  RigReport report;
  report.scale = NumberOrNan(json.at("scale"));
  report.scale_spread = NumberOrNan(json.at("scale_spread"));
  report.frames = json.at("frames").get<int>();
  report.pairs = json.at("pairs").get<int>();
  report.free_sigma_px = NumberOrNan(json.at("free_sigma_px"));
  report.solve.sigma_px = NumberOrNan(json.at("sigma_px"));
  report.solve.rms_px = NumberOrNan(json.at("rms_px"));
  report.solve.iterations = json.at("iterations").get<int>();
  report.points_dropped = json.at("points_dropped").get<int>();
  return report;
}

std::string ToJson(const RefineReport& report) {
  // Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
  return JsonOf(report).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
