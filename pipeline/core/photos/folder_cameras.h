// pipeline/core/photos/folder_cameras.h -- do the photos of several folders share intrinsics?
#pragma once
#include <string>
#include <vector>

#include "calib/bundle/camera_sharing.h"
#include "capture/capture.h"
#include "pipeline/core/calibration_report.h"
#include "pipeline/core/photos/camera_groups.h"

namespace dtr::pipeline {

/// A model whose folders share intrinsics where held-out observations allow it.
struct FolderCameras {
  calib::SfmModel model;
  std::vector<FolderSharing> tests;  ///< one per pool that is of several cameras
  std::vector<std::string> notes;    ///< a line per pool
};

/// Tests each of groups.pools() (calib::ShareCameras). Without `test`, the model stays as it is and
/// the lines say so.
FolderCameras ChooseFolderCameras(const CameraGroups& groups, const capture::Capture& capture,
                                  const calib::SfmModel& model, bool test,
                                  const calib::SharingOptions& options);

}  // namespace dtr::pipeline
