// calib/reference_tracks/score.h -- how well cameras predict sights that they were not adjusted to.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "calib/reference_tracks/tracks.h"

namespace dtr::calib {

/// What a sight that is not predicted counts as: a squared error of so many scales, which the loss
/// gives to no residual below e^50 scales. A camera fewer is thus no advantage.
inline constexpr double kMissedScales = 10;

struct YardstickScore {
  /// Root mean over all sights of Cauchy's loss (bundle/held_out.h), or of what is missed.
  double error_px = 0;
  double median_px = 0;  ///< residual length of the sights that are predicted; 0 without any
  int sights = 0;        ///< of the yardstick: the same for all cameras
  int predicted = 0;     ///< of them
};

/// Holds out every sight of every track in turn: the point is placed by the cameras of its other
/// sights (Triangulate, two of them at least) and the residual is taken in the photo, lens
/// included. Sights of photos without a camera in the model are not predicted, and help to place
/// nothing. `photos` are the names that tracks count by. The same result for any number of threads.
YardstickScore ScoreCameras(const SfmModel& model, std::span<const std::string> photos,
                            std::span<const Track> tracks, double loss_scale_px, int threads);

}  // namespace dtr::calib
