// calib/sfm/mapping/map_model.h -- internal to calib/sfm/mapping: a map as a model.
#pragma once
#include <vector>

#include "calib/sfm/mapping/points.h"
#include "calib/sfm_model.h"

namespace dtr::sfm {

/// The placed images with all their features, and the points. Image and camera ids are indices of
/// the graph + 1. A feature that several points have goes to the one that most images see; points
/// that are left with fewer than two features are dropped from `points`, too.
calib::SfmModel ModelOf(const ViewGraph& graph, const MapCameras& cameras,
                        std::vector<MapPoint>* points);

}  // namespace dtr::sfm
