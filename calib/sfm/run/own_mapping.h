// calib/sfm/run/own_mapping.h -- the global mapper, and COLMAP's where its model does not pass.
#pragma once
#include <vector>

#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/workspace.h"

namespace dtr::sfm {

/// Models of the workspace's matches, largest first; none where no photos can be placed. Where a
/// model of the global mapper does not pass, or the photos do not determine it
/// (calib/bundle/refine.h, WhyUndetermined), EXIF's focal lengths are held, if that gives every
/// photo a camera. Where this does not help, or photos are left out, with SfmEngine::kAuto and a
/// COLMAP that works, COLMAP maps the same matches (ColmapSteps::Map);
/// with one that does not, a note says so. COLMAP's largest
/// must agree with the matches (sfm/mapping/model_check.h); it is taken where ours did not pass,
/// where the photos determine it and not ours, or where it has more photos and does not predict
/// held-out observations clearly worse. What was decided is noted, and kept in the workspace.
/// Where no model passes, the one with more photos of those that most photos have a camera in and
/// that the photos determine is returned, with SfmReport::doubt; without such a one Error is
/// thrown: the reason, and what helps. A model of photos with stations
/// is returned untested, where there is one: only their stations make it what it is to be.
std::vector<calib::SfmModel> MapOrFallBack(Workspace& workspace,
                                           const std::vector<CameraGroup>& groups,
                                           const SfmOptions& options);

/// File in the workspace that says which mapper made its model, and why photos have no camera.
inline constexpr char kOwnMappingNote[] = "own_mapping.json";

/// Adds to `report` what that file says: the mapper to version, photos to why_not_registered.
void ReadOwnMappingNote(const Workspace& workspace, SfmReport& report);

}  // namespace dtr::sfm
