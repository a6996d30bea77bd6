#include "pipeline/bench/calibration_sweep.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/bundle/held_out.h"
#include "calib/colmap/program.h"
#include "calib/reference_tracks/score.h"
#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/run/feature_plan.h"
#include "capture/duplicates.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/machine.h"
#include "dtr/io/set_io.h"
#include "pipeline/bench/detail/sweep_axes.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/photos/input_hash.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

enum CalibrationAxis : size_t { kSfm, kFeatureSize, kFeatures, kMatching, kCameraModel, kRefine };
constexpr const char *kYes = "yes", *kNo = "no", *kMax = "max";
// Scale of the loss over the photos' long side: half a pixel of 1000, about what observations err
// by, so that wrong ones, which err the same by any cameras, do not hide what the cameras do.
constexpr double kLossShare = 0.0005;
constexpr double kExact = 1e-9;  // px; what stands for 0 on a logarithmic axis

/// As `dtr build` takes them.
capture::Capture PhotosOf(const CalibrationSweepOptions& options, Progress& progress) {
  capture::Capture photos =
      capture::IngestPhotos(options.photos, {.memory_gb = kDefaultMemoryGb}, progress);
  (void)capture::DropSameImages(photos, [](const std::string&) { return false; });
  capture::RequireEnoughPhotos(photos, options.photos);
  return photos;
}

void RequirePhotosOfTheSet(const CalibrationSweepOptions& options,
                           const std::vector<std::string>& names) {
  const DtrSet set = io::ReadSet(options.set);
  for (const View& view : set.frames.front().views) {
    if (std::any_of(names.begin(), names.end(), [&](const std::string& name) {
          return IsCalled(name, view.name) || IsCalled(view.name, name);
        })) {
      continue;
    }
    throw Error(
        fmt::format("`photos` {}: expected the photos that {} was built from, found none called {}",
                    options.photos.string(), options.set.string(), view.name));
  }
}

std::vector<calib::Track> ReferenceTracksOf(const capture::Capture& photos, const fs::path& folder,
                                            Progress& progress) {
  const auto read = [&](int i) {
    const capture::Photo& photo = photos.photos[static_cast<size_t>(i)];
    capture::PhotoPixels pixels = capture::ReadPhotoAndMask(photo);
    return calib::ReferenceTracksPhoto{std::move(pixels.image), std::move(pixels.mask)};
  };
  auto tracks = calib::FindTracks(static_cast<int>(photos.photos.size()), read, progress);
  if (tracks.size() < calib::kMinHeldOut) {
    throw Error(fmt::format(
        "`photos` {}: expected {} points that {} or more photos show, to measure cameras by, found "
        "{}; take photos that overlap more",
        folder.string(), calib::kMinHeldOut, calib::kMinTrackLength, tracks.size()));
  }
  return tracks;
}

/// Where a preselection keeps every pair there is nothing to choose.
std::vector<std::string> MatchingValues(size_t photos) {
  const sfm::Matching own = sfm::ResolveMatching(sfm::Matching::kAuto, photos);
  std::vector<std::string> values{sfm::NameOf(own)};
  for (const auto matching : {sfm::Matching::kExhaustive, sfm::Matching::kPreselected}) {
    if (matching != own && photos > sfm::matching::kPartners + 1) {
      values.emplace_back(sfm::NameOf(matching));
    }
  }
  values.emplace_back(sfm::NameOf(sfm::Matching::kSequential));
  return values;
}

/// Without COLMAP there is one engine.
std::vector<std::string> EngineValues() {
  std::vector<std::string> values{sfm::NameOf(sfm::SfmEngine::kGlobal)};
  if (colmap::Program::IsInstalled()) {
    values.emplace_back(sfm::NameOf(sfm::SfmEngine::kColmap));
  }
  return values;
}

}  // namespace

CalibrationSweep::CalibrationSweep(CalibrationSweepOptions options, Progress& progress)
    : options_(std::move(options)), progress_(progress) {
  photos_ = PhotosOf(options_, progress_);
  std::vector<std::pair<int, int>> sizes_px;
  int longest = 0;
  for (const capture::Photo& photo : photos_.photos) {
    names_.push_back(photo.name);
    sizes_px.emplace_back(photo.width_px, photo.height_px);
    longest = std::max({longest, photo.width_px, photo.height_px});
  }
  RequirePhotosOfTheSet(options_, names_);
  tracks_ = ReferenceTracksOf(photos_, options_.photos, progress_);
  loss_scale_px_ = kLossShare * longest;
  axes_ = {{"sfm", EngineValues()},
           {"feature-size",
            SizeValues(options_.feature_sizes_px, FeatureImageSizePx(sizes_px, kDefaultMemoryGb))},
           {"features", {kMax, "4096", "2048"}},
           {"matching", MatchingValues(names_.size())},
           {"lens-model", {SfmChoice{}.lens_model, "SIMPLE_RADIAL", "OPENCV"}},
           {"refine", {kYes, kNo}}};
}

const std::string& CalibrationSweep::Value(const eval::SweepSetting& setting, size_t axis) const {
  return axes_[axis].values.at(static_cast<size_t>(setting.at(axis)));
}

SfmChoice CalibrationSweep::ChoiceOf(const eval::SweepSetting& setting) const {
  SfmChoice choice;
  choice.feature_size_px = std::stoi(Value(setting, kFeatureSize));
  choice.engine = Value(setting, kSfm) == sfm::NameOf(sfm::SfmEngine::kColmap)
                      ? sfm::SfmEngine::kColmap
                      : sfm::SfmEngine::kGlobal;
  const std::string& features = Value(setting, kFeatures);
  choice.features = features == kMax ? MaxFeaturesOf(choice.engine) : std::stoi(features);
  for (const auto matching :
       {sfm::Matching::kExhaustive, sfm::Matching::kPreselected, sfm::Matching::kSequential}) {
    if (Value(setting, kMatching) == sfm::NameOf(matching)) choice.matching = matching;
  }
  choice.lens_model = Value(setting, kCameraModel);
  return choice;
}

eval::SweepMeasurement CalibrationSweep::Measure(const eval::SweepSetting& setting) const {
  NotesOnly notes(progress_);
  CalibrateOptions calibrate;
  calibrate.seed = options_.seed;
  calibrate.memory_gb = kDefaultMemoryGb;
  calibrate.refine = Value(setting, kRefine) == kYes;
  calibrate.sfm = ChoiceOf(setting);
  // Refinement begins where structure from motion ends: with and without it there is one workspace.
  std::string folder;
  for (const CalibrationAxis axis : {kSfm, kFeatureSize, kFeatures, kMatching, kCameraModel}) {
    folder += (folder.empty() ? "" : "-") + Value(setting, axis);
  }
  const double start_ms = ProcessCpuMilliseconds();
  const CalibratedPhotos calibrated =
      CalibratePhotos(photos_, calibrate, options_.work / folder, notes);
  eval::SweepMeasurement measured;
  measured.cost = (ProcessCpuMilliseconds() - start_ms) / kMillisecondsPerSecond +
                  calibrated.engine_cpu_s + calibrated.kept_refinement_cpu_s;
  measured.cost_least = measured.cost_most = measured.cost;

  const calib::ReferenceTracksScore score =
      calib::ScoreCameras(calibrated.model, names_, tracks_, loss_scale_px_);
  measured.error = std::max(score.error_px, kExact);
  measured.figures = {{"not_registered", static_cast<double>(calibrated.not_registered.size())},
                      {"points", static_cast<double>(calibrated.model.points.size())},
                      {"reference_observations", score.observations},
                      {"reference_tracks_predicted", score.predicted},
                      {"median_px", score.median_px}};
  return measured;
}

std::string CalibrationSweep::Identity() const {
  std::string identity = InputHash(options_.photos) + " " + sfm::kOwnVersion;
  const sfm::ColmapState program = colmap::Program::Find();
  if (program.Works()) identity += " " + program.version;
  return identity;
}

std::string CalibrationSweep::Conditions() const {
  return fmt::format(
      "{} photos, one calibration of each setting; measured by {} points that structure from "
      "motion knows nothing of, every observation of them held out in turn",
      names_.size(), tracks_.size());
}

eval::SweepStage CalibrationSweep::Stage() const {
  eval::SweepStage stage;
  stage.name = "calibration";
  stage.cost_name = "CPU s of the calibration, COLMAP's included";
  stage.error_name = "held-out reprojection, px of the photo";
  stage.axes = axes_;
  stage.applies = [](const eval::SweepSetting&, size_t) { return true; };
  stage.measure = [this](const eval::SweepSetting& setting) { return Measure(setting); };
  return stage;
}

}  // namespace dtr::pipeline
