// calib/bundle/adjust.h -- bundle adjustment: all cameras, poses and points at once.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/bundle/bundle.h"
#include "calib/precision.h"
#include "dtr/base/progress.h"

namespace dtr::calib {

/// Which numbers of the lenses may move.
enum class LensFreedom {
  kFixed,             ///< none: the lenses are known
  kFocal,             ///< focal lengths alone
  kNoPrincipalPoint,  ///< focal lengths and distortion, as COLMAP does
  kAll,
  /// All, and of radial lenses tangential distortion, too: they become kOpenCv. A lens whose
  /// elements lie beside each other, or whose sensor leans, has its distortion's centre elsewhere
  /// than its principal point (Brown 1966).
  kTangential,
  /// All, and the principal point of every image by itself, as image stabilisers move it. It is
  /// held near its lens's by a standard deviation of kStabiliserShare of the image's long side, so
  /// that what the observations cannot tell stays put. Not with poses that are fixed, nor for rigs.
  kPrincipalPointPerImage,
  kTangentialPerImage,  ///< both of these
};
/// "fixed", "focal", "no-principal-point", "all", "tangential", "principal-point-per-image",
/// "tangential-per-image".
const char* NameOf(LensFreedom freedom);

/// Where a camera's centre is known to be (GPS): in the bundle's own world and unit.
struct PositionPrior {
  int image = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma = Eigen::Vector3d::Ones();  ///< per axis, > 0
};

/// A measured distance between two cameras' centres.
struct DistancePrior {
  int image_a = 0, image_b = 0;
  double distance = 0, sigma = 1;  ///< both > 0
};

/// What is known of real cameras, for the two options of AdjustOptions: principal points lie within
/// some 2 % of the image's long side of the middle, pixels are square to better than 1 %. Where
/// cameras are given, their own values take the place of the middle and of squares.
inline constexpr double kKnownPrincipalPointShare = 0.02, kKnownAspectSigma = 0.01;
/// What observations tell no better than this share of what is known is open.
inline constexpr double kOpenShare = 0.25;

struct AdjustOptions {
  LensFreedom lens = LensFreedom::kNoPrincipalPoint;
  /// Observations farther from their predictions than this many standard deviations (robust: of the
  /// better third) do not count; 0: all count.
  double outlier_sigmas = 5;
  bool fix_poses = false;  ///< only points (and lenses, as `lens` says) move
  std::vector<PositionPrior> positions;
  std::vector<DistancePrior> distances;
  /// Above 0: free principal points are known to be where they start, to a standard deviation of
  /// this share of the image's long side. Where the observations do not determine them, as on a
  /// turntable or any orbit at one height, they stay there.
  double principal_point_share = 0;
  /// Above 0: of lenses with two free focal lengths their ratio is known to be what it is at the
  /// start, to this standard deviation of its logarithm. An orbit at one height leaves that open,
  /// too.
  double aspect_sigma = 0;
  /// The lenses that the two above speak of, as many as the bundle has; null: those of the start.
  /// With them, a solve can start from another's result. Borrowed.
  const std::vector<LensCamera>* known_lenses = nullptr;
  /// Solve by Ceres what plain/plain_adjust.h can solve, too: the reference of its tests.
  bool by_ceres = false;
  /// Asked after every iteration whether to stop: Interrupted is thrown then. Null: unset.
  const Progress* progress = nullptr;
};

/// Standard deviation of what is known of a lens's principal point; infinite where nothing is or it
/// may not move.
double PrincipalPointSigmaPx(const LensCamera& lens, const AdjustOptions& options);
/// Likewise of the logarithm of fy / fx.
double AspectSigma(const LensCamera& lens, const AdjustOptions& options);
/// Whether principal points of lenses move.
bool FreesPrincipalPoint(LensFreedom freedom);
/// Whether every image has a principal point of its own.
bool IsPerImage(LensFreedom freedom);
/// Whether radial lenses get tangential distortion, and whether this is one.
bool IsTangential(LensFreedom freedom);
bool MayGetTangential(const LensCamera& lens);

/// How a solve ended, in numbers.
struct AdjustSummary {
  int observations = 0;  ///< used ones
  /// Standard deviation of a used observation's coordinate, unknowns counted, lenses' and poses' as
  /// far as they were free; infinite where there are as many unknowns as numbers.
  double sigma_px = 0;
  double rms_px = 0;      ///< root mean squared residual length of the used observations
  int without_pixel = 0;  ///< observations whose point has no pixel: behind the camera
  int iterations = 0;
  bool converged = false;
  /// Observations whose part in the solve would change once more: which are outliers was decided
  /// again after each of four solves, and had not settled with the last. 0: it had.
  int unsettled = 0;
};

/// What a solve found.
struct Adjusted : AdjustSummary {
  Bundle bundle;
  LensFreedom lens = LensFreedom::kFixed;
  std::vector<bool> used;  ///< per observation: false for outliers and observations without a pixel
};

/// Minimises the sum over observations of |predicted - observed|^2, starting at `bundle`: under
/// Cauchy's loss until cameras and scale have settled, then least squares of the observations that
/// agree.
///
/// Inside, the world is centred and scaled, and points are directions with inverse distances
/// (observation_cost.h). Perspective models up to OPENCV without known positions and distances are
/// solved by plain/plain_adjust.h, all else by Ceres. The gauge is that of the start: without
/// priors, the result is turned, scaled and moved as a whole to be as near to the start's cameras
/// as can be (gauge.h); no camera is singled out. With priors on positions, these decide; with
/// distances alone, these decide the scale.
///
/// Sums in one order: the same bits every time, for any number of threads. Throws Error as
/// CheckBundle does, on priors that cannot be meant, and when no observation has a pixel or the
/// solver finds no finite solution. What the observations cannot decide is reported by
/// ValidatePhotos (calib/validation/photos.h), not here.
Adjusted Adjust(const Bundle& bundle, const AdjustOptions& options);

/// Whether `held`, which held more than `free` did, contradicts the observations: what is left of
/// them is half as large again (and more than half a pixel), or a tenth of them agrees no longer.
/// What disagrees with a camera is left out, and shows as that.
bool Contradicts(const Adjusted& held, const Adjusted& free);

/// Residuals predicted - observed in px, NaN where the point has no pixel; the bundle's order.
std::vector<Eigen::Vector2d> Residuals(const Bundle& bundle);

}  // namespace dtr::calib
