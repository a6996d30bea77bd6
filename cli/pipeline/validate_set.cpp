#include "cli/pipeline/validate_set.h"

namespace dtr::pipeline {

calib::ValidationReport ValidateSet(const DtrSet& set, const SparseScene& sparse,
                                    const calib::ValidateLimits& limits, int threads,
                                    const calib::BundleLimits& judge_limits) {
  std::vector<PinholeCamera> cameras;
  std::vector<Pose> poses;
  std::vector<std::string> names;
  for (const View& view : set.frames.front().views) {
    cameras.push_back(view.camera);
    poses.push_back(view.cam_from_world);
    names.push_back(view.name);
  }
  calib::ValidationReport report =
      calib::ValidateReprojection(cameras, poses, sparse, limits, names, threads);
  const calib::Judgement judgement =
      calib::Judge(calib::BundleOf(cameras, poses, names, sparse), judge_limits, threads);
  report.tests.insert(report.tests.end(), judgement.tests.begin(), judgement.tests.end());
  report.adjustment_json = calib::ToJson(judgement);
  return report;
}

}  // namespace dtr::pipeline
