// calib/bundle/refine.h -- is a model better after bundle adjustment? Only if held-out observations
// say so.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/bundle/adjust.h"
#include "calib/bundle/covariance_report.h"
#include "calib/bundle/degeneracy.h"
#include "calib/sfm_model.h"

namespace dtr::calib {

struct RefineOptions {
  /// Lenses that are known, by camera id: they are held, and replace the model's.
  std::optional<std::map<std::uint32_t, LensCamera>> known_lenses;
  bool separate_lenses = false;  ///< every image a lens of its own
  bool covariance = false;       ///< work out RefineReport::covariance
  /// What is known beside the observations, in the model's world and unit; `image` is an index into
  /// SfmModel::images. Held by every solve, those of the candidates, too.
  std::vector<PositionPrior> positions;
  std::vector<DistancePrior> distances;
  /// The name of the model, or of its photos, where it must determine its cameras:
  /// Refine asks RequireDetermined before it adjusts anything. Empty: unset.
  std::string determined;
  /// What helps where it does not; empty: more views, or a camera that is known.
  std::string advice = {};
  std::uint64_t seed = 0;  ///< of the observations that are held out
  /// AdjustOptions::progress of every solve, each of which is a stage; may be null.
  Progress* progress = nullptr;
};

/// A way to refine, and what it does to observations it has not seen.
struct RefineCandidate {
  std::string name;                 ///< "as given" or a LensFreedom
  std::optional<LensFreedom> lens;  ///< empty: cameras as given
  double held_out_px = 0;  ///< root mean of Cauchy's loss over points that were not adjusted to
  /// 95 % bootstrap interval of this candidate's mean loss less that of the best candidate with
  /// less freedom, in px^2; points drawn with replacement.
  double low_px2 = 0, high_px2 = 0;
  bool converged = false;  ///< else it is not taken
  /// Of lenses of one image each: the terms that its solve leaves undetermined, and how far; then
  /// it is not taken. Empty: none, or it was no better anyway.
  std::string undetermined = {};
  /// How surely the principal point is not where it was given, in standard deviations; 0 where
  /// nobody asked: unseen points told already.
  double principal_point_sigmas = 0;
};

/// What refinement did, without the model: numbers for records.
struct RefineReport {
  bool changed = false;  ///< false: the model is as it was given
  std::string reason;    ///< why nothing was changed; empty otherwise
  std::vector<RefineCandidate> candidates;
  int held_out_observations =
      0;  ///< that the model as given and the adjusted one were compared on,
  double given_px = 0, adjusted_px = 0;  ///< root mean of Cauchy's loss over these
  std::optional<LensFreedom> lens;
  AdjustSummary solve;  ///< of the chosen candidate, all observations; only where `changed`
  int points_dropped = 0;
  /// Of that solve, where it was asked for and the model was changed.
  std::optional<CovarianceReport> covariance;
};

struct Refined : RefineReport {
  SfmModel model;     ///< the chosen one
  Adjusted adjusted;  ///< of the chosen candidate, all observations; bundle emptied
};

/// Bundle adjustment of `model` where it pays. Cameras are adjusted to half of the points, without
/// the principal point, with it, with tangential distortion, and with a principal point for every
/// image (stabilised lenses), and tried on the other half, and the other way round: more is freed
/// only if that explains unseen points better beyond the bootstrap interval, and for numbers that
/// every image has by itself by 1 % at least. With a lens for every image (separate_lenses) its
/// focal length is free first; its distortion, then its principal point are freed only where points
/// that chose and points that did not are both explained better, principal points being known to 2
/// % of the image, and where the solve determines what was freed. The chosen way is then run on all
/// observations, as structure from motion was; the result is taken only if its cameras predict one
/// observation of each point from the others better than the cameras as given, beyond the bootstrap
/// interval.
///
/// With known lenses, poses and points are adjusted to them without being asked whether it pays;
/// with known positions or distances, the lenses' freedom is chosen as above, and the result taken
/// whether or not it predicts the observations better: what is known is to hold.
/// Deterministic for any number of threads. What cannot be refined (a lens model FOV, too few
/// points) comes back unchanged, with the reason; errors of broken models are thrown, and
/// those of RequireDetermined where options.determined asks for it.
Refined Refine(const SfmModel& model, const RefineOptions& options);

/// Refine of a model whose cameras were fitted to other data than its observations, such
/// as cameras of a file with points triangulated afterwards. As they have seen no observation, they
/// are a candidate like the others: the result is taken only if cameras adjusted to half of the
/// points predict the other half better than the cameras as given, beyond the bootstrap interval.
/// RefineReport::held_out_observations counts these points, given_px and adjusted_px are of them.
/// Priors and known lenses are Refine's.
Refined RefineIndependent(const SfmModel& model, const RefineOptions& options);

/// In what ways the views of a model do not suffice (degeneracy.h), its poses, points and lenses
/// free as Refine leaves them, what is known beside the observations held. At most 4000 points take
/// part. A model with a FOV lens has none to tell of.
std::vector<Degeneracy> DegeneraciesOf(const SfmModel& model, const RefineOptions& options);

/// Throws Error naming the degeneracy where one leaves poses, points or focal lengths undetermined.
/// `what`: the model or photos, for the message. (Copies of an image and models of two determine
/// their cameras; `dtr validate` tells of them.)
void RequireDetermined(const SfmModel& model, const RefineOptions& options,
                       const std::string& what);

/// The same as a clause, "" where the model determines them.
std::string WhyUndetermined(const SfmModel& model, const RefineOptions& options);

/// Median length (px) of held-out residuals: one observation of each point in 4 images or more, the
/// point placed by the others. `count`: how many. NaN where there are none.
double HeldOutErrorPx(const SfmModel& model, std::uint64_t seed, int* count);

/// The model with these lenses, by camera id. Throws Error where one is missing, or is of images of
/// another size.
SfmModel WithLenses(SfmModel model, const std::map<std::uint32_t, LensCamera>& lenses);

/// What is to be said of a result that is no error: that which observations count had not settled.
/// Empty: nothing.
std::string RemarkOn(const Refined& refined);

/// JSON object: refined, reason, lens, candidates[].{name,held_out_px,converged},
/// held_out_observations, given_px, adjusted_px, sigma_px, rms_px, iterations, converged,
/// unsettled_observations, points_dropped, covariance (where asked for).
std::string ToJson(const RefineReport& report);

}  // namespace dtr::calib
