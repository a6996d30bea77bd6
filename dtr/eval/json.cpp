#include "dtr/eval/json.h"

#include "dtr/eval/metrics.h"
#include "dtr/eval/report_json.h"
#include "dtr/types/check_json.h"

namespace dtr::eval {
namespace {

using Json = nlohmann::ordered_json;

Json Value(const ViewScore& score) {
  return {{"name", score.name},
          {"psnr_db", NumberOrNull(score.psnr_db)},
          {"psnr_covered_db", NumberOrNull(score.psnr_covered_db)},
          {"psnr_cc_db", NumberOrNull(score.psnr_cc_db)},
          {"psnr_own_depth_db", NumberOrNull(score.psnr_own_depth_db)},
          {"identical", IdenticalFigures({{"psnr_db", score.psnr_db},
                                          {"psnr_covered_db", score.psnr_covered_db},
                                          {"psnr_cc_db", score.psnr_cc_db},
                                          {"psnr_own_depth_db", score.psnr_own_depth_db}})},
          {"ssim", NumberOrNull(score.ssim)},
          {"coverage", NumberOrNull(score.coverage)},
          {"views_used", score.views_used},
          {"render_ms", NumberOrNull(score.render_ms)}};
}

Json Value(const DepthScores& s) {
  return {{"share_within_1pct", NumberOrNull(s.share_within_1pct)},
          {"share_within_2pct", NumberOrNull(s.share_within_2pct)},
          {"share_within_half_px", NumberOrNull(s.share_within_half_px)},
          {"share_within_1px", NumberOrNull(s.share_within_1px)},
          {"share_within_2px", NumberOrNull(s.share_within_2px)},
          {"median_relative_error", NumberOrNull(s.median_relative_error)},
          {"outlier_share", NumberOrNull(s.outlier_share)},
          {"outlier_share_5pct", NumberOrNull(s.outlier_share_5pct)},
          {"depth_completeness", NumberOrNull(s.depth_completeness)},
          {"completed_pixels", s.completed_pixels},
          {"completed_share_within_5pct", NumberOrNull(s.completed_share_within_5pct)},
          {"share_estimated_without_truth", NumberOrNull(s.share_estimated_without_truth)},
          {"edge_displacement_px", NumberOrNull(s.edges.displacement_px)},
          {"edge_fattening_px", NumberOrNull(s.edges.fattening_px)},
          {"edges_found_share", NumberOrNull(s.edges.found_share)},
          {"share_within_1_sigma", NumberOrNull(s.sigma.share_within_1_sigma)},
          {"share_within_2_sigma", NumberOrNull(s.sigma.share_within_2_sigma)},
          {"share_within_3_sigma", NumberOrNull(s.sigma.share_within_3_sigma)},
          {"sparsification_ratio", NumberOrNull(s.sigma.sparsification_ratio)},
          {"sparsification_ratio_if_normal", NumberOrNull(s.sigma.sparsification_ratio_if_normal)},
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
          {"median_px", any ? NumberOrNull(view.median_px) : Json(nullptr)},
          {"p95_px", any ? NumberOrNull(view.p95_px) : Json(nullptr)}};
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

Json JsonOf(const CrossDepthReport& report) {
  Json json;
  json["passed"] = report.passed();
  json["tests"] = dtr::JsonOf(report.tests);
  json["views"] = Json::array();
  for (const CrossDepthOfView& view : report.views) json["views"].push_back(Value(view));
  json["all"] = Value(report.all);
  return json;
}

std::string ToJson(const CrossDepthReport& report) { return Text(JsonOf(report)); }

std::string ValidationJson(const std::vector<Check>& tests) {
  return Text({{"passed", AllPassed(tests)}, {"tests", dtr::JsonOf(tests)}}, -1);
}

}  // namespace dtr::eval
