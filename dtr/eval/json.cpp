#include "dtr/eval/json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/eval/metrics.h"

namespace dtr::eval {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has neither NaN nor infinity.
Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json Number(const std::optional<double>& value) { return value ? Number(*value) : Json(nullptr); }

Json Value(const ViewScore& score) {
  return {{"name", score.name},
          {"psnr_db", Number(score.psnr_db)},
          {"psnr_covered_db", Number(score.psnr_covered_db)},
          {"psnr_own_depth_db", Number(score.psnr_own_depth_db)},
          {"identical", IdenticalFigures({{"psnr_db", score.psnr_db},
                                          {"psnr_covered_db", score.psnr_covered_db},
                                          {"psnr_own_depth_db", score.psnr_own_depth_db}})},
          {"ssim", Number(score.ssim)},
          {"coverage", Number(score.coverage)},
          {"views_used", score.views_used},
          {"render_ms", Number(score.render_ms)}};
}

Json Value(const DepthScores& s) {
  return {{"share_within_1pct", Number(s.share_within_1pct)},
          {"share_within_2pct", Number(s.share_within_2pct)},
          {"share_within_half_px", Number(s.share_within_half_px)},
          {"share_within_1px", Number(s.share_within_1px)},
          {"share_within_2px", Number(s.share_within_2px)},
          {"median_relative_error", Number(s.median_relative_error)},
          {"outlier_share", Number(s.outlier_share)},
          {"outlier_share_5pct", Number(s.outlier_share_5pct)},
          {"depth_completeness", Number(s.depth_completeness)},
          {"share_estimated_without_truth", Number(s.share_estimated_without_truth)},
          {"edge_displacement_px", Number(s.edges.displacement_px)},
          {"edge_fattening_px", Number(s.edges.fattening_px)},
          {"edges_found_share", Number(s.edges.found_share)},
          {"share_within_1_sigma", Number(s.sigma.share_within_1_sigma)},
          {"share_within_2_sigma", Number(s.sigma.share_within_2_sigma)},
          {"share_within_3_sigma", Number(s.sigma.share_within_3_sigma)},
          {"sparsification_ratio", Number(s.sigma.sparsification_ratio)},
          {"sparsification_ratio_if_normal", Number(s.sigma.sparsification_ratio_if_normal)},
          {"outlier_share_by_tenth", s.sigma.outlier_share_by_tenth},
          {"truth_pixels", s.truth_pixels},
          {"kept_pixels", s.kept_pixels}};
}

Json Value(const CrossDepthOfView& view) {
  const bool any = view.compared > 0;
  return {{"name", view.name},
          {"compared", view.compared},
          {"occluded", view.occluded},
          {"contradicted", view.contradicted},
          {"median_px", any ? Number(view.median_px) : Json(nullptr)},
          {"p95_px", any ? Number(view.p95_px) : Json(nullptr)}};
}

Json Value(const std::vector<Check>& tests) {
  Json list = Json::array();
  for (const Check& test : tests) {
    list.push_back({{"name", test.name},
                    {"value", Number(test.value)},
                    {"limit", Number(test.limit)},
                    {"passed", test.passed},
                    {"reason", test.reason}});
  }
  return list;
}

/// Names come from files: bytes that are no UTF-8 must not make the whole report unreadable.
std::string Text(const Json& json, int indent = 2) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string ToJson(const EvaluationReport& report, const std::optional<DepthScores>& depth) {
  Json json;
  json["views"] = Json::array();
  for (const ViewScore& view : report.views) json["views"].push_back(Value(view));
  json["mean"] = Value(report.mean);
  json["mean"].erase("name");
  json["mean"].erase("views_used");
  json["not_registered"] = report.not_registered.size();
  json["not_registered_names"] = report.not_registered;
  json["leave_one_out"] = report.leave_one_out;
  if (depth) json["depth"] = Value(*depth);
  return Text(json);
}

std::string ToJson(const DepthScores& scores) { return Text(Value(scores)); }

std::string ToJson(const CrossDepthReport& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = Value(report.tests);
  json["views"] = Json::array();
  for (const CrossDepthOfView& view : report.views) json["views"].push_back(Value(view));
  json["all"] = Value(report.all);
  return Text(json);
}

std::string ValidationJson(const std::vector<Check>& tests) {
  return Text({{"passed", AllPassed(tests)}, {"tests", Value(tests)}}, -1);
}

}  // namespace dtr::eval
