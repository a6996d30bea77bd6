// calib/reference_tracks/score.h -- how well cameras predict observations that they were not
// adjusted to.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/reference_tracks/tracks.h"
#include "calib/sfm_model.h"

namespace dtr::calib {

/// What an observation that is not predicted counts as: a squared error of so many scales, which
/// the loss gives to no residual below e^50 scales. A camera fewer is thus no advantage.
inline constexpr double kMissedScales = 10;

struct ReferenceTracksScore {
  /// Root mean over all observations of Cauchy's loss (bundle/held_out.h), or of what is missed.
  double error_px = 0;
  double median_px = 0;  ///< residual length of the observations that are predicted; 0 without any
  int observations = 0;  ///< of the reference tracks: the same for all cameras
  int predicted = 0;     ///< of them
};

/// Holds out every observation of every track in turn: the point is placed by the cameras of its
/// other observations (Triangulate, two of them at least) and the residual is taken in the photo,
/// lens included. Observations of photos without a camera in the model are not predicted, and help
/// to place nothing. `photos` are the names that tracks count by. The same result for any number of
/// threads.
ReferenceTracksScore ScoreCameras(const SfmModel& model, std::span<const std::string> photos,
                                  std::span<const Track> tracks, double loss_scale_px);

}  // namespace dtr::calib
