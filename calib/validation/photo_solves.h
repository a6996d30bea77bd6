// calib/validation/photo_solves.h -- internal to calib/validation: stored cameras, solved for
// again.
#pragma once
#include <string>
#include <vector>

#include "calib/validation/photos.h"
#include "dtr/base/progress.h"

namespace dtr::calib {

inline constexpr int kMinObservationsOfHalf = 30;  ///< of an image in halves, of all: half must do

/// The bundle with the observations of points that `keep` takes by their index.
template <typename Keep>
Bundle WithPoints(const Bundle& bundle, const Keep& keep) {
  Bundle some = bundle;
  std::erase_if(some.observations, [&](const BundleObservation& o) {
    return !keep(static_cast<std::uint64_t>(o.point));
  });
  return some;
}

/// Two halves of the points of the images that have enough; empty where too few have.
struct Halves {
  std::vector<Bundle> parts;
  std::string left_out;  ///< images that have too few observations for it
};
Halves HalvesOf(const Bundle& stored);

struct FreshSolves {
  AdjustOptions options;         ///< that they were made with
  Adjusted solved[3];            ///< all points, two halves
  BundleCovariance covariance;   ///< of all points
  std::vector<Degeneracy> open;  ///< what of the lenses was held, as the observations leave it open
  std::vector<int> open_centres;  ///< lenses whose principal points are among that
};

/// Solves for all from `stored`, everything free. What the observations leave open they leave to
/// noise: the solve wanders along it, by as much for little noise as for more, and its curvature
/// there is noise itself. So principal points and ratios of focal lengths that are little better
/// known than of any camera (kKnownPrincipalPointShare, kKnownAspectSigma) are held in a second
/// solve. Throws as Adjust does.
FreshSolves SolveAfresh(const Bundle& stored, const Halves& halves, const Progress* progress);

}  // namespace dtr::calib
