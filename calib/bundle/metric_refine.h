// calib/bundle/metric_refine.h -- a model in metres: places on Earth and measured distances are
// held while it is adjusted.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/bundle/refine.h"

namespace dtr::calib {

/// Where the camera of an image was: metres east, north and up of an origin that all share.
struct KnownPlace {
  int image = 0;  ///< index into SfmModel::images
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  /// Standard deviations per axis on the map and in height; 0: not stated, they are found.
  double sigma_flat_m = 0, sigma_up_m = 0;
};

/// A measured distance between the cameras of two images.
struct KnownDistance {
  std::string name;  ///< for errors
  int image_a = 0, image_b = 0;
  double length_m = 0;
  double sigma_m = 0;  ///< 0: not stated, kUnstatedRelativeSigma of the length
};

struct KnownMetres {
  std::vector<KnownPlace> places;
  std::vector<KnownDistance> distances;
  /// Rounds after which it is given up that places settle (MetricReport::settled).
  int max_passes = 10;
};

/// What holding it did.
struct MetricReport {
  double metres_per_unit = 1;  ///< of the model that was given, by all cameras together
  double relative_sigma = 0;   ///< of the scale, as the places and distances say it
  std::vector<int> left_out;   ///< images whose place does not agree with the others
  /// Root mean square distances of the places that agree: of the model carried there as a whole,
  /// and as it was adjusted.
  double given_rms_m = 0, rms_m = 0;
  /// False where the places err too much for the scale, and distances alone give it: then they turn
  /// and shift the whole, and hold nothing.
  bool places_tell_scale = true;
  double places_relative_sigma = 0;  ///< of the scale, as the places alone say it
  /// Whether which places agree, and how far they err, stayed as it was in the last of the passes.
  bool settled = true;
  int passes = 0;
  double sigma_flat_m = 0, sigma_up_m = 0;  ///< of places that state none; 0: all do
  double turn_sigma_rad = 0;                ///< of the whole, about the axis known worst
  /// Per distance: between the cameras of the model carried there as a whole, of the adjusted one,
  /// and how far that is from what was measured, in its standard deviations.
  std::vector<double> given_m, found_m, sigmas_off;
};

/// A model in metres, and how it is to be refined.
struct MetricStart {
  SfmModel model;         ///< carried there as a whole
  RefineOptions options;  ///< with positions and distances
  /// The places that agree: options.positions, too, unless they do not tell the scale.
  std::vector<PositionPrior> places;
  MetricReport report;  ///< what is known of the start
};

/// Carries `model` into metres: by the similarity to the places (x east, y north, z up); where they
/// do not tell the scale to kMaxRelativeSigma and distances do, by the mean scale of these, turned
/// and shifted to the places as a whole; where only distances are known, by that scale, its axes
/// kept. Places that tell the scale are held: some 4000 points are
/// adjusted, the places held (lenses without the principal point, or as known), again and again
/// until it is settled which of them agree (to kPositionOutlierSigmas robust standard deviations)
/// and how far they err where they do not say so. A model that is bent does not fit its places as a
/// whole: those at its ends would be left out, and its bend be taken for their error.
///
/// Throws Error where AlignToPositions does, where places without distances do not tell the scale
/// (RequireKnownScale), where a distance contradicts the places by more than
/// a bent model can, and where the photos contradict what is known (Contradicts, adjust.h).
MetricStart StartInMetres(const SfmModel& model, const KnownMetres& known,
                          const RefineOptions& options);

/// Refines it (Refine): the model in metres, `start.report` completed. Throws Error, naming it,
/// where a distance is missed by more than 5 of its standard deviations, where the scale comes out
/// uncertain by more than kMaxRelativeSigma, and where the model cannot be refined: nothing would
/// hold then.
Refined RefineInMetres(const KnownMetres& known, MetricStart& start);

}  // namespace dtr::calib
