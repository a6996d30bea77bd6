// calib/colmap/export.h -- our views as a COLMAP model.
#pragma once
#include <functional>

#include "calib/sfm_model.h"
#include "dtr/types/camera.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::colmap {

/// The same camera as a lens camera without a lens (PINHOLE). Both count pixels from the outer
/// corner of the top-left one, so that nothing shifts.
calib::LensCamera FromPinhole(const PinholeCamera& camera);

/// The views of the set's only frame and the sparse points behind it as a model: one PINHOLE camera
/// per distinct camera, ids from 1 in the order of views, names `View::name`, a feature per
/// observation. Poses and points are in the user's world, that is, with DtrSet::world_origin added:
/// COLMAP's files are double precision throughout. A point's colour is the mean over the views that
/// see it, of the images that `image_of` gives, one after another; without it points are black. A
/// point's error is recomputed.
/// Throws Error unless the set has exactly one frame and its names are unique,
/// std::invalid_argument when the scene names views or points that are not there.
calib::SfmModel ModelFromViews(const DtrSet& set, const SparseScene& scene,
                               const std::function<ImageRgb8(const View&)>& image_of = {});

}  // namespace dtr::colmap
