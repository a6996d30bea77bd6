// calib/sfm/run/without_camera.h -- why a photo found no camera, as far as its matches tell.
#pragma once
#include <map>
#include <string>

#include "calib/sfm/run/match_summary.h"
#include "calib/sfm/run/workspace.h"

namespace dtr::sfm {

/// For every photo of the workspace that is not in the `model` a clause, by the photo's
/// name, that says what it has in common with others: nothing at all, only with photos that have no
/// camera either, or too little for COLMAP, which places a photo by `min_common` of its features
/// that are points already (Mapper.abs_pose_min_num_inliers).
std::map<std::string, std::string> WhyWithoutCamera(const Workspace& workspace,
                                                    const MatchSummary& matches,
                                                    const calib::SfmModel& model, int min_common);

}  // namespace dtr::sfm
