// calib/sfm/mapping/resection.h -- internal to calib/sfm/mapping: an image placed by points that
// others have.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "calib/sfm/mapping/points.h"

namespace dtr::sfm {

/// A feature of an image and the point that it should show.
struct FeaturePoint {
  std::uint32_t feature = 0;
  int point = 0;
};

/// What the matches of `image` with placed images say its features show: by all pairs of the graph,
/// dropped ones included. One point per feature and one feature per point.
std::vector<FeaturePoint> PointsSeenBy(const ViewGraph& graph, int image,
                                       std::span<const MapPoint> points);

/// Pose of an image (FindPose), refined over the features that agree to `limit_px`; these stay in
/// `seen`. Empty where fewer than `min_agree` do.
std::optional<Pose> Resect(const ViewGraph& graph, const MapCameras& cameras, int image,
                           std::span<const MapPoint> points, double limit_px, int min_agree,
                           std::vector<FeaturePoint>* seen);

}  // namespace dtr::sfm
