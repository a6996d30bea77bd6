// pipeline/build/build.h -- photos in, D+TR set out: what `dtr build` does.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/split_panoramas.h"
#include "capture/video/ingest_video.h"
#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/core/calibration_report.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/metres.h"
#include "pipeline/core/sfm_settings.h"

namespace dtr::pipeline {

/// Options of `dtr build`, by the same names.
struct BuildOptions {
  std::filesystem::path photos;  ///< folder, a video, or a folder of nothing but videos
  capture::VideoOptions video;
  capture::PanoramaUse panoramas = capture::PanoramaUse::kAuto;  ///< which photos are split
  std::filesystem::path output;                                  ///< NAME.dtr
  std::string holdout;                                           ///< "", "every:N" or names
  bool holdout_strict = false;
  DepthChoice depth;
  int max_size_px = -1;           ///< long side; 0 = full size, -1 = what the preset says
  std::filesystem::path poses;    ///< known cameras, of a format that CameraFormats() names
  std::string poses_format = {};  ///< its name; empty: by the content
  bool keep_duplicates = false;   ///< photos with the same pixels as another one
  bool refine = true;             ///< bundle adjustment after SfM, where it pays
  bool refine_poses = false;      ///< the same of the cameras of `poses`
  std::filesystem::path rig;      ///< calibration of the rig that took all photos; empty: none
  SfmChoice sfm;                  ///< how cameras are looked for
  MetreOptions metres;            ///< places and distances that the refinement holds
  bool force = false;
  std::string force_stage;  ///< of an interrupted run: done again with all after it; "": none
  std::uint64_t seed = 0;
};

/// What was built.
struct BuildReport {
  DtrSet set;                                                ///< without pixels
  std::vector<std::string> not_registered;                   ///< photos that found no camera
  std::map<std::string, std::string> why_not_registered;     ///< by name, where that is known
  std::vector<std::string> held_out_not_registered;          ///< of them, those that were held out
  std::vector<std::pair<std::string, std::string>> skipped;  ///< file, reason
  /// File, what of it was converted or is not used.
  std::vector<std::pair<std::string, std::string>> remarks;
  capture::FolderContents contents;  ///< of the folder of photos
  /// Photos that screening has something to say about, with what it is; they are used all the same.
  std::vector<std::pair<std::string, std::vector<std::string>>> screening;
  bool validated = false, validation_passed = false;
  std::vector<std::string> coverage;  ///< what the capture lacks, in words; empty without depth
  std::filesystem::path written;      ///< the set
  CalibrationReport calibration;
  std::optional<DepthPriorReport> prior;  ///< where there was one
  std::vector<io::RunStage> stages;       ///< what each cost
  double peak_memory_mib = 0;             ///< with COLMAP's
};

/// JSON object: set, views[].{name,role,width_px,height_px}, not_registered[], why_not_registered,
/// skipped[], remarks[], contents, screening[], camera_sharing (where folders were compared),
/// coverage[], validation_passed (null: not validated), depth_prior (where there was one),
/// stages[], peak_memory_mib.
std::string ToJson(const BuildReport& report);

/// What BuildOptions::force_stage may be: the stages of which a build keeps something between runs,
/// in their order.
std::vector<std::string> StagesKept();

/// Builds a set. Continues an interrupted run of the same input and options; throws UsageError when
/// the output exists (without force) or belongs to another run.
BuildReport BuildSet(const BuildOptions& options, Progress& progress);

}  // namespace dtr::pipeline
