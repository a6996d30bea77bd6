// calib/colmap/own_mapping.h -- the global mapper, and COLMAP's where its model does not pass.
#pragma once
#include <functional>
#include <vector>

#include "calib/colmap/workspace.h"

namespace dtr::colmap {

/// Models of the workspace's database, largest first; none where no photos can be placed. With
/// SfmEngine::kAuto, a model of the global mapper that does not pass, that the photos do not
/// determine (calib/bundle/refine.h, WhyUndetermined) or that leaves photos out, and COLMAP on the
/// PATH, `by_colmap` is called for the models that COLMAP makes of the same matches. The largest
/// must agree with the matches (sfm/mapping/model_check.h); it is taken where ours did not pass,
/// where the photos determine it and not ours, or where it has more photos and does not predict
/// held-out observations clearly worse. What was decided is noted, and kept in the workspace.
/// Throws Error where no model passes: the reason, and what helps.
std::vector<calib::SfmModel> MapOrFallBack(
    Workspace& workspace, const SfmOptions& options,
    const std::function<std::vector<calib::SfmModel>()>& by_colmap);

/// File in the workspace that says which mapper made its model, and why photos have no camera.
inline constexpr char kOwnMappingNote[] = "own_mapping.json";

/// Adds to `report` what that file says: the mapper to version, photos to why_not_registered.
void ReadOwnMappingNote(const Workspace& workspace, SfmReport& report);

}  // namespace dtr::colmap
