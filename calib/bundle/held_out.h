// calib/bundle/held_out.h -- what cameras make of points and observations that they have not seen.
#pragma once
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "calib/bundle/adjust.h"

namespace dtr::calib {

/// Below so many points a comparison would be a matter of luck; only those count that so many
/// images see: one observation to hold out, three to place the point.
inline constexpr int kMinHeldOut = 100, kMinTrack = 4;

/// About `most` of the points, drawn by their ids.
Bundle SomePoints(const Bundle& bundle, int most, std::uint64_t seed);

/// Options of a solve that frees `lens`; none: points alone move.
AdjustOptions OptionsFor(const std::optional<LensFreedom>& lens);

/// One half of the points to adjust cameras to, the other to try them on.
struct PointFold {
  Bundle training, asked;
};
/// Two: each half is asked once. Halves are drawn by the points' ids.
std::vector<PointFold> PointFolds(const Bundle& bundle, std::uint64_t seed);

/// Per point of `asked` that kMinTrack images or more see: the mean over its observations of
/// Cauchy's loss (px^2), the point placed as the cameras (lenses and images) explain it best. An
/// observation without a pixel counts like one far off. `sigma_px`, where asked for, becomes the
/// standard deviation of an observation's coordinate.
std::vector<double> LossesOfHeldOutPoints(const Bundle& cameras, const Bundle& asked,
                                          double scale_px, double* sigma_px = nullptr);

/// One observation of each point that kMinTrack images or more see is kept apart.
struct ObservationSplit {
  Bundle training;
  std::vector<BundleObservation> held_out;
};
ObservationSplit SplitObservations(const Bundle& bundle, std::uint64_t seed);

/// Cauchy's loss (px^2) of each observation kept apart, its point placed by the others alone: for
/// cameras that have seen all observations.
std::vector<double> LossesOfHeldOutObservations(const Bundle& cameras,
                                                const ObservationSplit& split, double scale_px);

/// Cauchy's loss (px^2) of a residual; of one that is not finite as if 100 scales long.
double CauchyLoss(const Eigen::Vector2d& residual_px, double scale_px);

double Mean(const std::vector<double>& values);

/// 95 % percentile interval of mean(a - b), items drawn with replacement.
std::pair<double, double> BootstrapOfDifference(const std::vector<double>& a,
                                                const std::vector<double>& b, std::uint64_t seed);

}  // namespace dtr::calib
