// pipeline/core/cameras/exif_focal.h -- focal lengths that contradict EXIF.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/sfm/run/sfm.h"
#include "pipeline/core/cameras/photo_refinement.h"
#include "pipeline/core/photos/camera_groups.h"

namespace dtr::pipeline {

/// A camera whose focal length is not EXIF's.
struct FocalContradiction {
  double exif_px = 0, found_px = 0;
};

/// A focal length of EXIF is a whole number of millimetres, of a nominal lens that is focused to
/// infinity, and film equivalents are defined by the width or by the diagonal: 15 % cover these.
inline constexpr double kExifFocalError = 0.15;

/// The camera of the model that is farthest from the median focal length that EXIF gives its
/// photos, where that is more than kExifFocalError; empty where none is.
std::optional<FocalContradiction> ContradictsExif(const calib::SfmModel& model,
                                                  const std::vector<sfm::SfmImageInput>& photos);

/// What RefineSfm needs to map and refine.
struct SfmRun {
  const capture::Capture& capture;
  const CalibrateOptions& options;
  const CameraGroups& groups;
  const std::vector<sfm::SfmImageInput>& inputs;
  const sfm::SfmOptions& sfm_options;
  std::filesystem::path workspace;
};

/// RefinePhotos of what RunSfm made. Where its focal length contradicts EXIF, the matches are
/// mapped again with EXIF's, and that model is taken unless held-out observations of the first are
/// predicted clearly better; where the observations do not determine a focal length either, EXIF's
/// is held. `sfm` becomes what was taken; the report gets `exif_focal`; one line has both values.
PhotoRefinement RefineSfm(const SfmRun& run, sfm::SfmResult& sfm, Progress& progress);

}  // namespace dtr::pipeline
