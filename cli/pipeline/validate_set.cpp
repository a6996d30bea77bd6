#include "cli/pipeline/validate_set.h"

#include <algorithm>

#include "cli/pipeline/set_rig.h"

namespace dtr::pipeline {

namespace {

struct Cameras {
  std::vector<PinholeCamera> cameras;
  std::vector<Pose> poses;
  std::vector<std::string> names;
  std::vector<bool> held_out;
};

Cameras CamerasOf(const DtrSet& set) {
  Cameras of;
  for (const View& view : set.frames.front().views) {
    of.cameras.push_back(view.camera);
    of.poses.push_back(view.cam_from_world);
    of.names.push_back(view.name);
    of.held_out.push_back(view.role == ViewRole::kHeldOut);
  }
  return of;
}

}  // namespace

calib::ValidationReport ReprojectionOfSet(const DtrSet& set, const SparseScene& sparse,
                                          const calib::ValidateLimits& limits, int threads) {
  const Cameras of = CamerasOf(set);
  return calib::ValidateReprojection(of.cameras, of.poses, sparse, limits, of.names, threads,
                                     of.held_out);
}

calib::ValidationReport ValidateSet(const DtrSet& set, const SparseScene& sparse,
                                    const calib::ValidateLimits& limits, int threads,
                                    const calib::BundleLimits& judge_limits) {
  calib::ValidationReport report = ReprojectionOfSet(set, sparse, limits, threads);
  const Cameras of = CamerasOf(set);
  const calib::Judgement judgement =
      calib::Judge(calib::BundleOf(of.cameras, of.poses, of.names, sparse), judge_limits, threads);
  report.tests.insert(report.tests.end(), judgement.tests.begin(), judgement.tests.end());
  const auto rig = RigOfSet(set);
  const auto places = rig ? RigPlaces(set, sparse, *rig) : std::nullopt;
  if (places) report.tests.push_back(*places);
  for (const calib::CameraJudgement& judged : judgement.cameras) {
    const auto camera =
        std::find_if(report.cameras.begin(), report.cameras.end(),
                     [&](const auto& validated) { return validated.name == judged.name; });
    if (camera != report.cameras.end()) camera->placed = judged.placed;
  }
  report.adjustment_json = calib::ToJson(judgement);
  report.not_judged = judgement.not_judged;
  return report;
}

}  // namespace dtr::pipeline
