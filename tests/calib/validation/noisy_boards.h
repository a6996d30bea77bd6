// tests/calib/validation/noisy_boards.h -- calibrations of boards whose corners have a given noise:
// honest ones must pass at each, what is wrong must be found at each.
#pragma once
#include "tests/calib/bundle/noise_sweep.h"
#include "tests/calib/validation/injected_faults.h"

namespace dtr::calib::testing {

inline Scene BoardScene() { return OneCamera(16, 20); }

inline Scene RigScene() {
  Scene scene;
  scene.cameras = RowOfCameras(2, 0.1, BoardModel::kPinhole);
  Rig rig = ExactRig(scene.cameras, 14, 7, false, 2);
  scene.views = std::move(rig.views);
  scene.rig_from_board = std::move(rig.rig_from_board);
  return scene;
}

/// As `calibrate board` and `calibrate rig` make it.
inline ValidatedCalibration Calibrated(const Scene& scene, double noise_px, std::uint64_t seed) {
  Rig rig;
  rig.views = scene.views;
  RigOptions options;
  options.solve.cover_image = false;
  const RigSolution solution =
      SolveRig(kBoard, InputsOf(scene.cameras), NoisyViews(rig, noise_px, seed),
               scene.rig_from_board.size(), options);
  EXPECT_EQ(solution.outliers, 0) << noise_px << " px";
  return CalibrationOf(solution);
}

/// Absolute limits are the user's to set: here they follow the noise.
inline BoardValidation ReportOf(const ValidatedCalibration& calibration, double noise_px) {
  BoardLimits limits;
  const double scale = std::max(1.0, noise_px / 0.1);
  limits.max_rms_px *= scale;
  limits.max_uncertainty_px *= scale;
  limits.max_far_uncertainty_px *= scale;
  return ValidateBoards(calibration, {}, limits);
}

inline void ExpectPassed(const ValidatedCalibration& calibration, double noise_px) {
  const BoardValidation report = ReportOf(calibration, noise_px);
  EXPECT_TRUE(report.passed()) << "noise " << noise_px << " px: " << BrokenTests(report.tests);
}

inline void ExpectFound(const ValidatedCalibration& calibration, double noise_px,
                        const char* name) {
  const BoardValidation report = ReportOf(calibration, noise_px);
  EXPECT_NE(BrokenTest(report.tests, name), nullptr)
      << name << ", noise " << noise_px << " px: " << BrokenTests(report.tests);
}

/// By which lengths are wrong, so that it is clear above the noise and above what is negligible.
inline double ClearlySeenFactor(double noise_px) { return 1.02 + 0.05 * noise_px; }

inline void ExpectBoardFaultsFound(const ValidatedCalibration& honest, double noise_px) {
  ValidatedCalibration focal = honest;
  focal.cameras[0].camera.params[0] *= ClearlySeenFactor(noise_px);
  ExpectFound(focal, noise_px, "lens_difference_sigmas");
  ValidatedCalibration repeated = honest;
  repeated.kept.push_back(honest.kept[0]);
  repeated.kept.back().frame = repeated.kept_frames++;
  repeated.kept.back().seen.name = "again";
  ExpectFound(repeated, noise_px, "repeated_views");
}

inline void ExpectRigFaultFound(ValidatedCalibration calibration, double noise_px) {
  calibration.cameras[1].cam_from_rig.translation *= ClearlySeenFactor(noise_px);
  ExpectFound(calibration, noise_px, "rig_scale_sigmas");
}

}  // namespace dtr::calib::testing
