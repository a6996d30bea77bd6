// calib/validation/photos.h -- is a stored calibration right, do its data suffice, and does it
// show?
#pragma once
#include <string>
#include <vector>

#include "calib/bundle/covariance.h"
#include "calib/bundle/degeneracy.h"
#include "calib/validation/reprojection.h"
#include "dtr/types/check.h"

namespace dtr::calib {

struct BundleLimits {
  /// Stored against freshly solved, in predicted standard deviations (Mahalanobis length): of six
  /// unknowns of a pose, chance alone exceeds 5 once in 3000.
  double max_sigmas = 5;
  /// A difference that moves the scene's points in the image by less than this many standard
  /// deviations of one observation's coordinate, but between the least and the most, is no fault,
  /// however many standard deviations of the cameras it is: solvers that treat outliers otherwise
  /// differ by as much.
  double negligible_sigmas = 3;
  double min_negligible_px = 0.1, max_negligible_px = 0.4;
  /// Two disjoint halves of the points, solved apart: RMS of their difference over the predicted.
  double max_halves_ratio = 3;
  /// 95 % of a third view's points, as its two best neighbours place them: standard deviation.
  double max_image_shift_px = 1;
  /// Residuals as of photos whose rows were read while the camera turned: RMS per coordinate that
  /// such turns explain beyond chance.
  double max_shutter_px = 0.1;
  /// Residuals that a lens model cannot follow, along the radius or by regions: RMS per coordinate
  /// that is beyond chance. Features err by themselves where a scene's texture does.
  double max_lens_pattern_px = 0.1;
  double min_p = 1e-4;                      ///< less likely by chance than this is no chance
  int max_unknowns = kMaxUnknowns;          ///< of a bundle that is validated in one part
  double max_focal_share = kMaxFocalShare;  ///< standard deviation of a focal length over itself
  /// The lenses were calibrated apart (a rig, a lens that was given): what the observations leave
  /// open of them is none the less known.
  bool lenses_are_given = false;
};

/// What of a difference is too little to matter, where an observation's coordinate has `sigma_px`.
double NegligiblePx(const BundleLimits& limits, double sigma_px);

/// What is known of one camera (image) after the fresh solve.
struct PhotoValidation {
  std::string name;
  double sigmas = 0;          ///< stored pose against the fresh one
  double moved_px = 0;        ///< RMS over its observations, stored camera against fresh one, in
                              ///< the world that is nearest to most (moved.h)
  double turn_sigma_rad = 0;  ///< largest axis of the turn's uncertainty
  double centre_sigma = 0;    ///< of the centre's, world units, in the free network's gauge
  double image_shift_px = 0;  ///< 95 %; NaN where no two neighbours place its points
  std::vector<PlacedPixel> placed;  ///< the points that it is the 95 % of
};

/// What is known of one lens: differences and uncertainties of its parameters.
struct IntrinsicsValidation {
  std::vector<std::string> names;
  std::vector<double> stored, fresh, sigma;
  double sigmas = 0, moved_px = 0;
};

struct PhotosValidation {
  /// Why (some) images of 10 observations or more have no validation result; empty where all have
  /// one. The test photos_not_validated then fails: no evidence is no pass.
  std::string not_validated;
  int parts = 1;  ///< that the images were validated in
  std::vector<Check> tests;
  std::vector<PhotoValidation> cameras;
  std::vector<IntrinsicsValidation> lenses;
  std::vector<Degeneracy> degeneracies;
  double sigma_px = 0, condition = 0, halves_ratio = 0;
  int observations = 0;
};

/// Validates cameras and poses of undistorted views against their own observations:
///  - all are solved for again from the observations, distortion included, and the stored ones are
///    compared with that, each pose and each lens as a Mahalanobis distance;
///  - two halves of the points, split by chance, are solved apart and compared; where they differ
///    by more than predicted, all uncertainties are widened by that factor;
///  - the covariance is carried to a third view's pixels (TransferCovariance);
///  - degeneracies are looked for by name, and principal points that were freed photo by photo
///  where
///    the observations leave them open (undetermined_terms);
///  - residuals are checked against patterns of the lens (lens_patterns.h) and a shutter that reads
///    row by row (shutter.h).
/// Some 4000 points, drawn by their index, take part, and all of photos that would be left few.
/// More than some 220 photos (kMaxUnknowns with three turns each) are validated in parts of about
/// 100 that see the same points, each by itself; of every test the worst part's figure is reported.
/// Deterministic for any number of threads. Throws Error on a broken bundle only, and Interrupted
/// where `progress` asks for it.
PhotosValidation ValidatePhotos(const Bundle& stored, const BundleLimits& limits,
                                const Progress* progress = nullptr);

/// JSON object: parts, sigma_px, condition, halves_ratio, observations, lenses[], cameras[],
/// degeneracies[], not_validated.
std::string ToJson(const PhotosValidation& validation);

}  // namespace dtr::calib
