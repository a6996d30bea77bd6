// calib/sfm/mapping/acceptance.h -- internal to calib/sfm/mapping: whether a map can be trusted.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/mapping/global_mapper.h"
#include "calib/sfm/mapping/points.h"

namespace dtr::sfm {

/// What the decision is made of.
struct MapEvidence {
  const ViewGraph& graph;
  const MapCameras& cameras;
  std::span<const MapPoint> points;
  std::span<const LeftOut> left_out;
};

/// Images that points of the map contradict: their median reprojection error is large, and three
/// times that of all.
std::vector<int> MisfitsOf(const ViewGraph& graph, const MapCameras& cameras,
                           std::span<const MapPoint> points);

/// Images that stay without a place when the map is built up again image by image: from the two
/// that share the most points, always the image that sees the most points whose depth the images
/// before it determine (two of them, rays 1 degree apart). Below `min_points` an image's distance
/// to them, and with it the scale of whatever hangs on it, is not determined, however small all
/// reprojection errors are. `most_points`: what the best of those left sees.
std::vector<int> LooselyJoined(const MapCameras& cameras, std::span<const MapPoint> points,
                               int min_points, int* most_points);

/// Share of a pair's matches that agree with the cameras: within `limit_px` of their epipolar
/// lines, in front of both cameras.
double AgreeingShare(const ViewGraph& graph, const MapCameras& cameras, const PairGeometry& pair,
                     double limit_px);

/// The parts of WhyNot that say whether matches contradict the map, and whether parts of it float.
std::string WhyNotContradicted(const MapEvidence& evidence, MapStatistics* statistics);
std::string WhyNotJoined(const MapEvidence& evidence);

/// Why the map must not be trusted, as one clause; empty: it can be. Completes `statistics` by
/// the errors and by what contradicts the map.
std::string WhyNot(const MapEvidence& evidence, MapStatistics* statistics);

}  // namespace dtr::sfm
