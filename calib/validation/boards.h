// calib/validation/boards.h -- can this calibration of boards be trusted?
#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/solve/rig_solve.h"
#include "calib/solve/term_uncertainty.h"
#include "calib/validation/patterns.h"
#include "calib/validation/projection.h"
#include "calib/validation/reprojection.h"
#include "dtr/base/progress.h"
#include "dtr/types/check.h"

namespace dtr::calib {

/// What a calibration must reach; docs/VALIDATION.md says why these are the defaults.
struct BoardLimits {
  double max_rms_px = 1;            ///< on views that the solve has not seen
  double max_rms_ratio = 1.5;       ///< of that, over what the solve's own residuals promise
  double max_region_ratio = 2.5;    ///< the worst region's RMS over the median region's
  double max_outlier_share = 0.05;  ///< of the corners that the solve has not seen
  /// Stored lens or place against a fresh solve of the corners the file keeps: they must be the
  /// same numbers, up to rounding and the solver's last step. (Against one of unseen views: less
  /// likely by chance than min_p.)
  double max_self_difference_sigmas = 0.5;
  double max_uncertainty_px = 0.5;  ///< at the boards' distance, in 95 % of the image
  double max_far_uncertainty_px = 1;
  double max_term_share = kMaxTermShare;  ///< of a coefficient, worst camera: term_uncertainty.h
  double min_views = 8;                   ///< per camera: two halves that can be solved
  double min_coverage = 0.5;  ///< share of 12 x 8 image regions with a corner, worst camera
  double min_tilt_deg = 15;   ///< largest angle between two boards, worst camera
  double min_p = 1e-4;        ///< less likely by chance than this is no chance
  /// A pattern in the residuals that is no chance: RMS per coordinate. What OpenCV's corner
  /// refinement does to corners is about 0.03 px (docs/VALIDATION.md).
  double max_pattern_px = 0.05;
  double max_time_offset_sigmas = 4.5;  ///< of a camera's delay against the first camera
};

/// What was calibrated, and the observations that the file keeps.
struct ValidatedCalibration {
  Board board;
  std::vector<RigCamera> cameras;
  std::vector<RigView> kept;  ///< with the outliers that the solve named
  size_t kept_frames = 0;
  bool free_lenses = true;  ///< false: the lenses were given, only places are unknowns
};

/// Views of the board that the calibration has not seen.
struct TestViews {
  std::vector<RigView> views;
  size_t frames = 0;
};

struct ValidatedView {
  std::string name;
  double rms_px = 0, worst_px = 0;
  int corners = 0, outliers = 0;
  std::vector<ResidualArrow> arrows;
  PhotoRotation rotation = PhotoRotation::kNone;  ///< BoardView::rotation
};

/// How uncertain projections are at a distance from the camera.
struct UncertaintyAt {
  double distance = 0;  ///< board units
  ImageMap map;         ///< px; empty where no solve was possible
};

struct ValidatedCamera {
  std::string name;
  ResidualStats stored;    ///< stored lens and place, boards alone refitted (kept or unseen views)
  ResidualStats held_out;  ///< kept views, each predicted by a solve of the other folds
  double noise_px = 0;     ///< median of what the pixels' noise makes of a coordinate; NaN unknown
  std::array<ResidualStats, kRegionsPerAxis * kRegionsPerAxis> regions;
  double distance = 0;                         ///< of the boards
  ImageMap near_uncertainty, far_uncertainty;  ///< px; empty where no solve was possible
  ImageMap difference;                         ///< px, stored against fresh
  /// Part of the uncertainties that the choice of the model is: the largest difference to another
  /// model that the corners do not tell from this one (solve/model_spread.h), at the boards'
  /// distance; zero and no name where there is none.
  ImageMap model_spread;
  std::string spread_model;                   ///< the one that differs most
  std::vector<UncertaintyAt> uncertainty_at;  ///< at the distances that were asked for
  double coverage = 0;
  std::vector<ValidatedView> views;  ///< worst first
};

struct BoardValidation {
  std::vector<Check> tests;
  std::vector<ValidatedCamera> cameras;
  /// Chessboards among the tested views that were counted from the other end, and repaired.
  std::vector<std::string> flipped;
  bool test_views = false;  ///< whether views were given that the calibration had not seen
  double sigma_px = 0;      ///< of the solve of the kept corners
  double condition = 0;     ///< ArrowInformation::condition of it
  bool passed() const { return AllPassed(tests); }
};

/// Everything docs/VALIDATION.md lists, in its order. A test that cannot be made fails and says
/// why; a degeneracy is named. `distances` (board units, > 0): where else uncertainty is reported,
/// which breaks no test. `progress` shows the steps and may interrupt. Requires kept
/// or unseen views of every camera; throws Error without.
BoardValidation ValidateBoards(const ValidatedCalibration& calibration,
                               const std::optional<TestViews>& test_views,
                               const BoardLimits& limits, std::span<const double> distances = {},
                               Progress* progress = nullptr);

/// JSON object: passed, result and conclusion (conclusion.h), tests[] as `validate` of sets has
/// them; cameras[] with stored and held_out residuals, noise_px, regions[9], coverage,
/// uncertainty_px and far_uncertainty_px {largest, p95, median}, uncertainty_at[] (the same with
/// distance), views[]; sigma_px, condition, test_photos, flipped[].
std::string ToJson(const BoardValidation& report);

// Of the views alone (data_tests.cpp), one check each, worst camera named.
Check TestViewCount(const ValidatedCalibration& calibration, double min_views);
Check TestCoverage(const ValidatedCalibration& calibration, double min_coverage);
Check TestTilt(const ValidatedCalibration& calibration, const Rig& fitted, double min_tilt_deg);
Check TestRepeats(const ValidatedCalibration& calibration, double sigma_px);
Check TestBoardsFromBehind(const ValidatedCalibration& calibration, const Rig& fitted);
double CoverageOf(const ValidatedCalibration& calibration, size_t camera);

}  // namespace dtr::calib
