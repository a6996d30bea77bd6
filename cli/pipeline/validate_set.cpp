#include "cli/pipeline/validate_set.h"

namespace dtr::pipeline {

calib::ValidationReport ValidateSet(const DtrSet& set, const SparseScene& sparse,
                                    const calib::ValidateLimits& limits, int threads) {
  std::vector<PinholeCamera> cameras;
  std::vector<Pose> poses;
  std::vector<std::string> names;
  for (const View& view : set.frames.front().views) {
    cameras.push_back(view.camera);
    poses.push_back(view.cam_from_world);
    names.push_back(view.name);
  }
  return calib::ValidateReprojection(cameras, poses, sparse, limits, names, threads);
}

}  // namespace dtr::pipeline
