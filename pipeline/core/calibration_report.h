// pipeline/core/calibration_report.h -- how the cameras of a set were found, in numbers: what its
// provenance keeps. No times and no paths, so that equal runs stay equal.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/bundle/refine.h"
#include "calib/bundle/rig_adjust.h"
#include "calib/validation/conventions.h"
#include "pipeline/core/metres.h"
#include "pipeline/core/set_rig.h"
#include "pipeline/core/sfm_settings.h"

namespace dtr::pipeline {

/// What COLMAP's mapping gave.
struct SfmSummary {
  double mean_reprojection_error_px = 0;
  std::vector<int> images_per_model;  ///< largest first; the first was taken
  std::string lack_of_parallax;       ///< a sentence; empty: enough pairs have parallax
  bool forward_motion = false;        ///< mapped with the thresholds of a walk straight ahead
  std::string doubt;                  ///< why the cameras are not sure; empty: they passed
  int feature_image_size_px = 0;      ///< long side to which photos were shrunk for features
  std::string lens_model;             ///< of the first camera; empty: there is none
};

/// Photos of one group in several folders: whether they share intrinsics (calib::ShareCameras has
/// what the figures mean).
struct FolderSharing {
  struct Camera {
    std::vector<std::string> folders;  ///< that share it
    double focal_px = 0;
  };
  int photos = 0;
  std::vector<std::string> folders;  ///< ".": the folder of the photos itself
  std::vector<Camera> cameras;
  std::string not_tested;  ///< why; empty: the figures below are there
  double shared_px = 0, separate_px = 0, low_px2 = 0, high_px2 = 0;
  bool shared_converged = false;
};

struct CameraSharing {
  CameraPer camera_per = CameraPer::kAuto;
  /// One for each group of photos that lies in several folders; no value: there is no such group.
  std::optional<std::vector<FolderSharing>> tests;
};

/// Bundle adjustment with the cameras of a rig fixed to each other.
struct RigPlacement {
  calib::RigReport adjusted;
  SetRig rig;
};

/// Bundle adjustment without a rig.
struct BundleAdjustment {
  calib::RefineReport refined;
  std::optional<MetreReport> metres;  ///< where positions or distances constrained it
};

/// A focal length of EXIF that contradicts what structure from motion found
/// (pipeline/core/cameras/exif_focal.h).
struct ExifFocal {
  double exif_px = 0;
  std::optional<double> found_px = {};  ///< empty: COLMAP made a model with EXIF's only
  /// Median lengths of held-out residuals of both models; empty where they were not compared.
  std::optional<double> exif_error_px = {}, found_error_px = {};
  bool exif_taken = false;   ///< else the one that was found
  bool focal_fixed = false;  ///< the focal length that was taken was not adjusted afterwards
};

struct CalibrationReport {
  std::optional<SfmSummary> sfm;  ///< empty: cameras were given
  size_t points = 0;              ///< of the model before bundle adjustment
  std::optional<RigPlacement> rig;
  std::optional<CameraSharing> camera_sharing;
  std::optional<BundleAdjustment> bundle_adjustment;
  std::optional<ExifFocal> exif_focal;
  /// Whether cameras that were given fit the photos.
  std::optional<calib::ConventionReport> given_cameras;
};

}  // namespace dtr::pipeline
