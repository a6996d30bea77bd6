// calib/sfm/mapping/tracks.h -- internal to calib/sfm/mapping: features of many images that show
// one point.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/view_graph.h"

namespace dtr::sfm {

/// A feature of an image.
struct TrackFeature {
  int image = 0;
  std::uint32_t feature = 0;
};

/// Features that show one point, by rising images; no image twice.
using Track = std::vector<TrackFeature>;

/// Chains matches into tracks (union-find), the pairs in the order of `pairs` (indices into
/// ViewGraph::pairs; the most trusted first). A match that would give a track two features of one
/// image is left out, so a wrong match cannot undo a track that better pairs made. Tracks are
/// sorted by their first image and feature; each has two features or more.
std::vector<Track> BuildTracks(const ViewGraph& graph, std::span<const int> pairs);

}  // namespace dtr::sfm
