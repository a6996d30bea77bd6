// pipeline/core/cameras/panorama_poses.h -- views of panoramas get the poses that their panorama
// has, whether structure from motion found them or not.
#pragma once
#include <filesystem>
#include <vector>

#include "calib/sfm/run/sfm.h"
#include "capture/photo.h"
#include "pipeline/core/set_rig.h"

namespace dtr::pipeline {

/// A view with fewer observations has no camera in the end: dtr validate needs 50 of each, some are
/// dropped on the way, and it shows
/// nothing that depth is found of (the sky, a blank ceiling).
inline constexpr int kMinViewObservations = 60;

/// Replaces `sfm.model`, which structure from motion made of free views (intrinsics known), by one
/// in which all views of each panorama that has a view in it stand as the rig says, and
/// triangulates the points of all matches again. Views with fewer than kMinViewObservations are
/// left out, with the reason in sfm.report.why_not_registered. Throws Error where no two panoramas
/// are left.
void CompletePanoramas(const capture::Capture& capture, const SetRig& rig,
                       const std::vector<sfm::SfmImageInput>& inputs,
                       const std::filesystem::path& workspace, const sfm::SfmOptions& sfm_options,
                       sfm::SfmResult& sfm, Progress& progress);

}  // namespace dtr::pipeline
