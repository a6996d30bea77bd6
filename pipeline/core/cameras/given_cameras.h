// pipeline/core/cameras/given_cameras.h -- cameras that came from elsewhere, and whether they fit
// the photos.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/bundle/refine.h"
#include "calib/sfm/run/known_poses.h"
#include "calib/validation/conventions.h"
#include "dtr/base/progress.h"
#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

struct GivenPhotos {
  std::string file;  ///< of the cameras, for messages
  std::vector<sfm::PosedImage> images;
  std::filesystem::path workspace;  ///< images are in photos/
  sfm::SfmOptions sfm;
};

struct TriangulatedCameras {
  calib::SfmModel model;
  calib::ConventionReport conventions;
};

/// Points of the photos with their cameras fixed (sfm::TriangulateWithPoses), and the test of
/// the cameras by all matches, not only those that became points (calib/validation/conventions.h).
/// Where these do not fit, or are too few, some photos are matched again without belief in any
/// camera. A note reports cameras that do not fit. Throws as TriangulateWithPoses; the error then
/// reports what explains it.
TriangulatedCameras TriangulateAndTest(const GivenPhotos& given, Progress& progress);

/// The test of cameras that bring points: by the observations of these, which a file can have wrong
/// in every way that its cameras can, and where they fit, by features of some photos: indices into
/// the model's images, which `given` lists in the same order, of photos that lie in
/// workspace/photos. A note reports cameras that do not fit.
calib::ConventionReport TestWithPoints(const calib::SfmModel& model, const GivenPhotos& given,
                                       const std::vector<size_t>& some, Progress& progress);

/// Some images of the model, in two clusters that share many points, by their index: features of
/// so few tell nearly as much as those of all. `may` says which may be among them.
std::vector<size_t> ImagesToTest(const calib::SfmModel& model, const std::vector<bool>& may);

/// How a model is adjusted.
struct RefineGivenOptions {
  /// Points were triangulated here, so that the cameras have not seen their observations.
  bool are_independent = false;
  std::uint64_t seed = 0;
};

/// Bundle adjustment of given cameras with the points that their photos show, where held-out
/// observations gain (calib::Refine). World and unit stay: the adjusted cameras lie as near to the
/// given ones as one similarity of all can bring them. One note says what was done, or why nothing.
calib::RefineReport RefineGiven(calib::SfmModel& model, const RefineGivenOptions& options,
                                Progress& progress);

/// `given_cameras_px`: what that test said when the set was made; empty for sets whose cameras were
/// not given so. Throws Error where the provenance is broken.
std::optional<Check> GivenCamerasCheck(const DtrSet& set);

}  // namespace dtr::pipeline
