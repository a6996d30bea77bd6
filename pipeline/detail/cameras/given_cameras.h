// pipeline/detail/cameras/given_cameras.h -- cameras that came from elsewhere, and whether they fit
// the photos.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/colmap/known_poses.h"
#include "calib/validation/conventions.h"
#include "dtr/base/progress.h"
#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

struct GivenPhotos {
  std::string file;  ///< of the cameras, for messages
  std::vector<colmap::PosedImage> images;
  std::filesystem::path workspace;  ///< images are in photos/
  colmap::SfmOptions sfm;
};

struct TriangulatedCameras {
  calib::SfmModel model;
  calib::ConventionReport conventions;
};

/// Points of the photos with their cameras fixed (colmap::TriangulateWithPoses), and the test of
/// the cameras by all matches, not only those that became points (calib/validation/conventions.h).
/// Where these do not fit, or are too few, some photos are matched again without belief in any
/// camera. A note reports cameras that do not fit. Throws as TriangulateWithPoses; the error then
/// reports what explains it.
TriangulatedCameras TriangulateAndTest(const GivenPhotos& given, Progress& progress);

/// `given_cameras_px`: what that test said when the set was made; empty for sets whose cameras were
/// not given so. Throws Error where the provenance is broken.
std::optional<Check> GivenCamerasCheck(const DtrSet& set);

}  // namespace dtr::pipeline
