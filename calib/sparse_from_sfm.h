// calib/sparse_from_sfm.h -- the sparse points of a structure-from-motion model, for undistorted
// views.
#pragma once
#include <span>
#include <string>

#include "calib/sfm_model.h"
#include "dtr/types/camera.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::calib {

/// Points and observations of the images `view_names` (SfmImage::name), pixels on the grids of
/// `undistorted` (one camera per name). Observation `view` indices count in `view_names`.
///
/// What only other images saw does not get in: points that fewer than two of the listed views see
/// are dropped, so that a list of the source views keeps held-out photos out of everything built
/// from points. Observations without a place on the undistorted grid's plane are dropped before
/// that count, and of fisheyes those off the image, whose errors the undistorted grid makes larger
/// by any factor; of other lenses those stay. Of two features of a view on one point the first
/// stays. Points keep the order of their ids; observations are sorted by (view, point).
///
/// `world_origin` is subtracted from the points, as it is from the views' poses (DtrSet).
/// Throws std::invalid_argument when the numbers of names and cameras differ, Error when a name is
/// not in the model or is listed twice.
SparseScene ToSparseScene(const SfmModel& model, std::span<const std::string> view_names,
                          std::span<const PinholeCamera> undistorted,
                          const Eigen::Vector3d& world_origin = Eigen::Vector3d::Zero());

}  // namespace dtr::calib
