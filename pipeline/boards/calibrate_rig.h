// pipeline/boards/calibrate_rig.h -- what the cameras of a rig saw becomes a calibration.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/calibration.h"
#include "calib/solve/rig_solve.h"
#include "calib/validation/free_running.h"
#include "calib/validation/patterns.h"
#include "pipeline/boards/rig_photos.h"

namespace dtr::pipeline {

struct RigCalibrationOptions {
  std::optional<calib::BoardModel> model;  ///< empty: each camera's own, by held-out views
  calib::SolveOptions solve;
  bool fixed_lenses = false;
  bool free_running = false;  ///< cameras take their images when they like: delays are found too
  std::map<std::string, calib::RigCameraInput> given;  ///< lenses by camera; then they are fixed
  std::uint64_t seed = 0;
};

struct RigSummary {
  size_t frames = 0;  ///< that count
  int corners = 0, outliers = 0;
  double rms_px = 0, sigma_px = 0;
  std::vector<std::string> flipped;
  std::vector<std::string> simpler;  ///< cameras that got a simpler model, and why, a line each
  int passes = 1;                    ///< solves, of free-running cameras
  /// Of cameras that were taken to be synchronised: what speaks against it (calib/validation).
  std::vector<std::optional<calib::CameraDelay>> delays;
  calib::PatternTest unsteady;  ///< images that keep no common rate (calib/validation)
};

/// Solves for the rig behind the photos; `progress` shows the solves and may interrupt.
/// Throws UsageError when lenses are given for some cameras and not for others, Error as
/// SolveRig and ChooseModel do.
calib::Calibration CalibrateRig(const calib::Board& board, const RigPhotos& photos,
                                const RigCalibrationOptions& options, RigSummary* summary,
                                Progress& progress);

/// A known lens (lens_file.h) as boards are solved with. Throws Error, starting with `where`, for
/// lens models that they are not solved with.
calib::RigCameraInput GivenLens(const calib::LensCamera& camera, const std::string& where);

/// By the name's extension: .json ours, .yml and .yaml OpenCV's stereo file of two cameras (M1, D1,
/// M2, D2, R, T), .txt COLMAP's cameras.txt. Throws Error for a .yml of another number of cameras.
void WriteRigFile(const std::filesystem::path& file, const calib::Calibration& calibration);

}  // namespace dtr::pipeline
