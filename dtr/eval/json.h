// dtr/eval/json.h -- the reports as JSON text, for programs. Names are an interface.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "dtr/eval/cross_depth.h"
#include "dtr/eval/depth_truth.h"
#include "dtr/eval/held_out.h"

namespace dtr::eval {

/// {"views":[{name,psnr_db,psnr_covered_db,psnr_cc_db,psnr_own_depth_db,identical:[...],ssim,coverage,
///    views_used,render_ms}],
///  "mean":{the same},"not_registered":count,"not_registered_names":[...],"leave_one_out":bool,
///  "depth":{...}}.
/// A figure that is not defined (no pixel to compare) or infinite (all pixels equal) is null;
/// "identical" names the infinite ones. A mean is over the views where the figure is defined, and
/// infinite if one of them is. "depth" only where given.
std::string ToJson(const EvaluationReport& report,
                   const std::optional<DepthScores>& depth = std::nullopt);

/// {share_within_1pct,share_within_2pct,share_within_half_px,share_within_1px,share_within_2px,
///  median_relative_error,outlier_share,outlier_share_5pct,depth_completeness,
///  share_estimated_without_truth,edge_displacement_px,edge_fattening_px,edges_found_share,
///  share_within_1_sigma,share_within_2_sigma,share_within_3_sigma,sparsification_ratio,
///  sparsification_ratio_if_normal,outlier_share_by_tenth:[...],truth_pixels,kept_pixels}.
std::string ToJson(const DepthScores& scores);

/// {passed,tests:[{name,value,limit,passed,reason}],views:[{name,compared,occluded,contradicted,
///  median_px,p95_px}],all:{the same}}.
std::string ToJson(const CrossDepthReport& report);

/// {"passed":bool,"tests":[...]}: a validation result, as sets carry it in DtrSet::validation_json.
/// Compact.
std::string ValidationJson(const std::vector<Check>& tests);

}  // namespace dtr::eval
