// calib/sfm/mapping/triangulate.h -- points for cameras that are given.
#pragma once
#include <span>

#include "calib/sfm/view_graph.h"
#include "calib/sfm_model.h"
#include "dtr/types/pose.h"

namespace dtr::sfm {

/// Model of all images of the graph with the graph's cameras and `cam_from_world` (one pose per
/// image), unchanged, and the points that they determine: matches that no point explains to 4 px of
/// an image of 1000 px are left out, the others chained into tracks, and each track's point is the
/// one that most of its features agree with. Points whose rays meet at less than 1.5 degrees are
/// left out. Image and camera ids are indices + 1. Same bytes for any number of threads (0: all
/// cores). Throws std::invalid_argument where poses and images differ in number.
calib::SfmModel TriangulateMatches(const ViewGraph& graph, std::span<const Pose> cam_from_world);

}  // namespace dtr::sfm
