// calib/validation/reprojection.h -- can a calibration be trusted? Residuals on held-out
// observations.
#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "calib/residuals.h"
#include "dtr/types/camera.h"
#include "dtr/types/check.h"
#include "dtr/types/pose.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::calib {

/// What a calibration must reach. The defaults were chosen between what honest models of real
/// photos give and what the smallest fault in the tests gives; docs/accuracy/CALIBRATION.md has
/// both.
struct ValidateLimits {
  double max_rms_px = 1.5;          ///< held-out residuals, all cameras together
  double max_camera_rms_px = 3.0;   ///< the same for the worst camera
  double max_camera_ratio = 3.0;    ///< the worst camera's RMS over the typical (median) camera's
  double max_stored_rms_px = 1.5;   ///< stored points, all cameras together
  double max_mean_px = 0.25;        ///< mean residual vector of the stored points, all cameras
  double max_camera_mean_px = 0.4;  ///< the same for the worst camera
  double max_impossible_share = 0.01;  ///< observations no point in front of the cameras explains
  int min_observations = 20;           ///< a camera with fewer tested ones cannot be evaluated
};

/// Arrows that a camera keeps at most: enough to see a pattern by, few enough to draw.
inline constexpr size_t kMaxArrows = 1500;

/// What became of one camera's observations.
struct CameraValidation {
  std::string name;
  ResidualStats held_out;  ///< against points triangulated from the other cameras alone
  ResidualStats stored;    ///< against the points as stored
  int short_tracks = 0;    ///< points seen by fewer than 3 cameras: nothing to hold out
  int weak_geometry = 0;   ///< the other cameras do not fix the point well enough to evaluate
  int impossible = 0;      ///< no point in front of the cameras explains the observations
  std::vector<ResidualArrow> arrows;  ///< of `held_out`: all, or evenly many of them
  std::vector<PlacedPixel>
      placed;  ///< of a fresh bundle adjustment (calib/validation/photos.h); may be empty
};

struct ValidationReport {
  std::vector<Check> tests;
  std::vector<CameraValidation> cameras;  ///< in the order given
  ResidualStats held_out, stored;         ///< all cameras together
  /// Held-out residuals by image region, row-major from the top left, all cameras together: a lens
  /// model that does not fit shows here first.
  std::array<ResidualStats, kRegionsPerAxis * kRegionsPerAxis> regions;
  std::vector<std::string> untested;  ///< cameras with too few tested observations
  /// Held-out cameras without a single observation, as --holdout-strict stores them: nothing here
  /// can test them, and nothing is asked of them; what they saw is for `dtr evaluate`.
  std::vector<std::string> kept_apart;
  bool passed() const { return AllPassed(tests); }
};

/// Tests cameras and poses against the sparse observations.
///
/// Held-out residuals: for every observation of a point with at least 3 of them, the point is
/// triangulated from the *other* cameras' observations alone (linear least-squares meeting point of
/// the rays, then Gauss-Newton on the reprojection error under Huber's loss) and projected into
/// this camera. The residual is honest about the point, not about the poses: these came from the
/// same observations. Observations whose point the others do not fix (rays within 1 degree of each
/// other, or a predicted error in this camera of more than twice the observation's own) are left
/// out and counted. Triangulation:
/// Hartley & Zisserman, 2nd ed., ch. 12.
///
/// Stored residuals: the points as stored, projected into every camera that saw them. They find
/// what a shared shift of all pixels does, which triangulation can absorb: a half-pixel slip of an
/// importer is a mean residual of half a pixel.
///
/// `names[i]`, `cameras[i]` and `cam_from_world[i]` belong together, and `held_out[i]` with them
/// (empty: none is): a held-out camera without any observation is kept apart instead of failing
/// `cameras_untested`. The result does not depend on `threads` (0: all cores). Throws Error when an
/// index is out of range, a number is not finite or the lists differ in length.
ValidationReport ValidateReprojection(std::span<const PinholeCamera> cameras,
                                      std::span<const Pose> cam_from_world,
                                      const SparseScene& scene, const ValidateLimits& limits,
                                      std::span<const std::string> names,
                                      const std::vector<bool>& held_out = {});

/// JSON object: passed, tests[].{name,value,limit,passed,reason},
/// cameras[].{name,held_out,stored,short_tracks,weak_geometry,impossible}, held_out, stored,
/// regions[9], untested[], kept_apart[]; residuals as
/// {count,rms_px,median_px,p95_px,worst_px,mean_x_px,mean_y_px}.
std::string ToJson(const ValidationReport& report);

}  // namespace dtr::calib
