// pipeline/dynamic/detail/scene_clocks.h -- cameras that began when they liked.
#pragma once
#include <vector>

#include "calib/lens_camera.h"
#include "calib/motion_clocks.h"
#include "dtr/base/progress.h"
#include "pipeline/dynamic/detail/recording.h"

namespace dtr::pipeline {

/// How many frames later each camera's images are, by the frames of the recording, of a longer one
/// 1200 from the first time step on (calib::FindMotionClocks). All in the recording's order of
/// cameras, in one world. Throws Error as that, where images are not of their camera's size, and as
/// Recording::ForEachFrame.
std::vector<calib::MotionClock> FindClocks(const Recording& recording,
                                           const std::vector<calib::LensCamera>& lenses,
                                           const std::vector<Pose>& cam_from_world,
                                           Progress& progress);

/// Takes each camera's nearest frame, and says in a note which.
void ShiftByClocks(const std::vector<calib::MotionClock>& clocks, Recording& recording,
                   Progress& progress);

}  // namespace dtr::pipeline
