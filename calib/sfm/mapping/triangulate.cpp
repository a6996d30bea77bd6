#include "calib/sfm/mapping/triangulate.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "calib/sfm/mapping/map_model.h"
#include "calib/sfm/mapping/points.h"

namespace dtr::sfm {
namespace {

constexpr double kMaxErrorPx = 4;  // of an image of 1000 px

// The matches of a pair that some point explains, near or far.
FeatureMatches Explained(const ViewGraph& graph, const MapCameras& cameras,
                         const PairGeometry& pair) {
  std::vector<Track> matches;
  for (const auto& [a, b] : pair.matches) matches.push_back({{pair.image_a, a}, {pair.image_b, b}});
  std::vector<int> all(matches.size());
  std::iota(all.begin(), all.end(), 0);
  FeatureMatches explained;
  const PointOptions any_distance{.max_error = kMaxErrorPx, .min_angle_rad = 0};
  for (const MapPoint& point : PointsOf(graph, cameras, matches, all, any_distance)) {
    explained.push_back(pair.matches[static_cast<size_t>(point.track)]);
  }
  return explained;
}

// Indices of the pairs, those with the most matches first.
std::vector<int> MostTrustedFirst(const std::vector<PairGeometry>& pairs) {
  std::vector<int> order(pairs.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return pairs[static_cast<size_t>(a)].matches.size() >
           pairs[static_cast<size_t>(b)].matches.size();
  });
  return order;
}

}  // namespace

calib::SfmModel TriangulateMatches(const ViewGraph& graph, std::span<const Pose> cam_from_world) {
  if (cam_from_world.size() != graph.images.size()) {
    throw std::invalid_argument("TriangulateMatches: one pose per image");
  }
  MapCameras cameras;
  cameras.lenses = graph.cameras;
  cameras.placed.assign(graph.images.size(), 1);
  cameras.cam_from_world.assign(cam_from_world.begin(), cam_from_world.end());
  cameras.rays = RaysOf(graph, graph.cameras);
  ViewGraph agreed = graph;
  for (PairGeometry& pair : agreed.pairs) {
    pair.matches = Explained(graph, cameras, pair);
  }
  const std::vector<Track> tracks = BuildTracks(agreed, MostTrustedFirst(agreed.pairs));
  std::vector<int> all(tracks.size());
  std::iota(all.begin(), all.end(), 0);
  auto points = PointsOf(graph, cameras, tracks, all, {.max_error = kMaxErrorPx});
  return ModelOf(graph, cameras, &points);
}

}  // namespace dtr::sfm
