// pipeline/dynamic/detail/fixed_cameras.h -- the cameras of a recording, which stay where they are.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "calib/motion_clocks.h"
#include "dtr/base/progress.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/set_rig.h"
#include "pipeline/dynamic/detail/recording.h"

namespace dtr::pipeline {

/// All vectors are in the recording's order of cameras.
struct FixedCameras {
  CalibratedPhotos calibrated;  ///< of the first time step; images are named as cameras
  std::vector<calib::LensCamera> lens;
  std::vector<Pose> cam_from_world;
  SparseScene sparse;      ///< points of the first time step; views are cameras
  SparseScene all_points;  ///< those of some time steps together: where surfaces were over time
  std::vector<calib::MotionClock> clocks;  ///< empty: taken as they are
};

struct FixedCameraOptions {
  CalibrateOptions calibrate;  ///< held_out: for each camera
  std::optional<SetRig> rig;   ///< its calibration holds; empty: structure from motion
  int max_size_px = 0;         ///< of the views, whose grid the points are on
  bool free_clocks = false;    ///< find them, and shift the recording by whole frames
};

/// Throws Error naming a camera that the rig does not have, or that has another size there, by the
/// images of the first time step: before any work, so that the corrected command finds none.
void RequireRigCameras(const SetRig& rig, const Recording& recording, const Progress& progress);

/// Requires RequireRigCameras. Cameras of a rig as they were calibrated, or as structure from
/// motion finds them in the images of one time step (which moving things do not disturb: it is one
/// moment), and points of the first, middle and last time step with these cameras held. A later
/// time step without points adds none, with a note. Throws Error naming a camera that structure
/// from motion did not find, and as FindClocks.
FixedCameras CalibrateFixedCameras(Recording& recording, const FixedCameraOptions& options,
                                   const std::filesystem::path& workspace, Progress& progress);

/// The view of a camera, without pixels and id.
View ViewOf(const FixedCameras& cameras, const Recording& recording, size_t camera,
            const std::vector<bool>& held_out, int max_size_px);

}  // namespace dtr::pipeline
