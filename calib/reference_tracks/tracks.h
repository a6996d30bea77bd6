// calib/reference_tracks/tracks.h -- points of a scene as photos show them, found without cameras
// and not by the features of structure from motion.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/grid.h"

namespace dtr::calib {

/// Where a photo shows a point.
struct PhotoObservation {
  int photo = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// One point: at most one observation per photo, by rising photo.
using Track = std::vector<PhotoObservation>;

/// What FindTracks asks for of a photo.
struct ReferenceTracksPhoto {
  ImageRgb8 image;
  Mask mask;  ///< of the image's size, or empty: all of it may be used
};

/// Observations of fewer photos tell no camera from another: one is held out, three place the
/// point.
inline constexpr int kMinTrackLength = 4;

/// Points that kMinTrackLength photos or more show. AKAZE (Alcantarilla, Nuevo, Bartoli, BMVC 2013)
/// looks for other places than COLMAP's SIFT, in another scale space, and describes them by bits:
/// what it finds took no part in any calibration, whatever the settings of that. Two photos'
/// features belong together where each is the other's nearest, clearly nearer than the next, and a
/// fundamental matrix agrees; no camera is asked. Chains that come back to a photo at another place
/// are left out. What is wrong all the same is the same for every camera it is held against.
///
/// `read` gives photo i; one photo is held at a time. Photos larger than kReferenceTracksSidePx are
/// looked at shrunk; pixels are always those of the whole photo. The same result for any number of
/// threads.
std::vector<Track> FindTracks(int photos, const std::function<ReferenceTracksPhoto(int)>& read,
                              Progress& progress);
inline constexpr int kReferenceTracksSidePx = 2400;

}  // namespace dtr::calib
