// pipeline/bench/calibration_sweep.h -- the calibration of a set's photos as a stage to
// sweep: what structure from motion may be told, by what it takes and how well its cameras predict
// observations that they were not adjusted to.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/reference_tracks/tracks.h"
#include "capture/photo.h"
#include "dtr/base/progress.h"
#include "dtr/eval/sweep.h"
#include "pipeline/core/sfm_settings.h"

namespace dtr::pipeline {

struct CalibrationSweepOptions {
  std::filesystem::path set;     ///< whose photos they are; nothing else of it is used
  std::filesystem::path photos;  ///< folder of the photos it was built from
  /// For COLMAP's workspaces, a folder per setting. They stay: a setting that is measured again
  /// goes on from its own, as COLMAP itself does not repeat.
  std::filesystem::path work;
  /// Long sides for features to try, the first the default; 0 and what is larger: what memory
  /// allows. Empty: that, seven tenths, half.
  std::vector<int> feature_sizes_px;
  std::uint64_t seed = 0;
};

/// Cost: processor seconds of the stage `calibration` of `dtr build`, COLMAP's included; those of
/// runs that lie in the workspace are the ones it recorded. Error: px of the whole photo, root mean
/// of Cauchy's loss over the observations of one set of reference tracks (calib/reference_tracks),
/// each held out in turn; an observation that a setting's cameras cannot predict, for want of a
/// camera, counts as far off. Figures: `not_registered`, `points`, `reference_observations`,
/// `reference_tracks_predicted`, `median_px`.
class CalibrationSweep {
 public:
  /// Reads the photos and finds the reference tracks. Throws UsageError for a folder without
  /// photos, Error for photos of another set and for such as share too little to measure by.
  CalibrationSweep(CalibrationSweepOptions options, Progress& progress);
  eval::SweepStage Stage() const;  ///< its functions borrow this object
  /// What decides the results beside the settings: photos, versions of the engines.
  std::string Identity() const;
  /// For people: what the reference tracks are.
  std::string Conditions() const;

 private:
  const std::string& Value(const eval::SweepSetting& setting, size_t axis) const;
  SfmChoice ChoiceOf(const eval::SweepSetting& setting) const;
  eval::SweepMeasurement Measure(const eval::SweepSetting& setting) const;

  CalibrationSweepOptions options_;
  Progress& progress_;
  capture::Capture photos_;
  std::vector<std::string> names_;  ///< of photos_
  std::vector<calib::Track> tracks_;
  double loss_scale_px_ = 0;
  std::vector<eval::SweepAxis> axes_;
};

}  // namespace dtr::pipeline
