// pipeline/core/calibrate.h -- from accepted photos to cameras, by SfM or from a file.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "capture/capture.h"
#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/core/calibration_report.h"
#include "pipeline/core/metres.h"
#include "pipeline/core/set_rig.h"
#include "pipeline/core/sfm_settings.h"

namespace dtr::pipeline {

/// How cameras are found.
struct CalibrateOptions {
  /// Empty: SfM; else cameras of a format that CameraFormats() names (camera_file.h).
  std::filesystem::path poses;
  std::string poses_format = {};  ///< its name; empty: by the content
  std::vector<bool> held_out;     ///< per photo; empty: none
  bool strict = false;  ///< held-out photos take no part in SfM and are registered afterwards
  std::uint64_t seed = 0;
  double memory_gb = 4;
  bool refine =
      true;  ///< bundle adjustment after SfM, where held-out observations say that it pays
  /// Cameras of `poses` are adjusted, too, where held-out observations say that it pays.
  bool refine_poses = false;
  /// Of all photos, known: it holds in matching, mapping and after. Photos may have been scaled as
  /// a whole since it was calibrated; else Error, before any work.
  std::optional<calib::LensCamera> lens;
  std::optional<SetRig> rig;  ///< took all photos: its lenses, places and scale hold
  MetreOptions metres;        ///< places and distances to hold while SfM's model is refined
  /// The name of the photos where SfM's model must determine its cameras, else Error before it is
  /// refined; empty: unset.
  std::string determined = {};
  SfmChoice sfm = {};
  bool fixed_intrinsics = false;  ///< the model's are to be held; CalibratePhotos sets it
  std::string advice =
      {};  ///< what helps where cameras are not determined; CalibratePhotos sets it
};

/// Calibrated photos, frozen: everything later depends on this model alone.
struct CalibratedPhotos {
  calib::SfmModel model;  ///< images named like the photos; sorted by name
  LengthUnit unit = LengthUnit::kArbitrary;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  std::vector<std::string> not_registered;  ///< photos without a camera
  /// By name, a clause that says why one has none, where that is known.
  std::map<std::string, std::string> why_not_registered;
  std::string engine;  ///< "colmap 3.8", "cameras.json", ...
  CalibrationReport report;
  /// Processor seconds of COLMAP's runs, and of all steps of structure from motion of an earlier
  /// call that this one continued from.
  double engine_cpu_s = 0;
  /// Of those runs and of bundle adjustment, what the earlier call's took: processor and wall-clock
  /// seconds.
  double earlier_cpu_s = 0, earlier_wall_s = 0;
  double kept_refinement_cpu_s = 0;  ///< of bundle adjustment that an earlier call did
};

/// JSON object: the report by its field names (`calibration` of a set's provenance), engine, unit,
/// registered (how many), not_registered[], why_not_registered, contents (of the photos' folder).
std::string ToJson(const CalibratedPhotos& calibrated, const capture::FolderContents& contents);

/// Whether features must be found: not where `poses` is a model that brings its points.
/// Throws Error where that is broken.
bool NeedsFeatures(const std::filesystem::path& poses, const std::string& poses_format);

/// Rejects before any work what cannot work: UsageError for `poses` that do not exist and for more
/// features than the engine takes, Error when
/// COLMAP is needed (by SfmEngine::kColmap, where NeedsFeatures) and not installed.
void RequireCalibration(const std::filesystem::path& poses, const std::string& poses_format,
                        const SfmChoice& sfm);

/// The long side to which SfM shrinks photos of these sizes (width and height, px), so that looking
/// for features in them fits into `memory_gb` (`asked_px` at most; 0: nothing is asked): it decides
/// the result, so it belongs to the inputs of a run that may go on later. Throws UsageError where
/// no size fits.
int FeatureImageSizePx(const std::vector<std::pair<int, int>>& sizes_px, double memory_gb,
                       int asked_px = 0);

/// Calibrates the photos. `workspace` keeps checkpoints: the same input and options continue there,
/// and a finished calibration is read back instead of computed again. With `part` only this part of
/// structure from motion is done, for one of several processes, and the result is empty.
CalibratedPhotos CalibratePhotos(const capture::Capture& capture, const CalibrateOptions& options,
                                 const std::filesystem::path& workspace, Progress& progress,
                                 const std::optional<sfm::SfmPart>& part = {});

}  // namespace dtr::pipeline
