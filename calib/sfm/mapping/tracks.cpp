#include "calib/sfm/mapping/tracks.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace dtr::sfm {
namespace {

bool ByImage(const TrackFeature& x, const TrackFeature& y) { return x.image < y.image; }

bool ShareAnImage(const Track& x, const Track& y) {
  for (size_t i = 0, k = 0; i < x.size() && k < y.size();) {
    if (x[i].image == y[k].image) return true;
    x[i].image < y[k].image ? ++i : ++k;
  }
  return false;
}

}  // namespace

std::vector<Track> BuildTracks(const ViewGraph& graph, std::span<const int> pairs) {
  constexpr int kNone = -1;
  std::vector<std::vector<int>> track_of(graph.images.size());
  for (size_t i = 0; i < graph.images.size(); ++i) {
    track_of[i].assign(graph.images[i].pixels.size(), kNone);
  }
  std::vector<Track> tracks;
  for (const int p : pairs) {
    const PairGeometry& pair = graph.pairs[p];
    for (const auto& [feature_a, feature_b] : pair.matches) {
      int& a = track_of[pair.image_a][feature_a];
      int& b = track_of[pair.image_b][feature_b];
      if (a != kNone && a == b) continue;
      if (a == kNone && b == kNone) {
        a = b = static_cast<int>(tracks.size());
        tracks.push_back({{pair.image_a, feature_a}, {pair.image_b, feature_b}});
        continue;
      }
      Track single;
      if (a == kNone) single = {{pair.image_a, feature_a}};
      if (b == kNone) single = {{pair.image_b, feature_b}};
      const bool both = single.empty();
      int into = a == kNone ? b : a;
      int from = both ? b : kNone;
      if (both && tracks[into].size() < tracks[from].size()) std::swap(into, from);
      const Track& added = both ? tracks[from] : single;
      if (ShareAnImage(tracks[into], added)) continue;
      Track merged;
      merged.reserve(tracks[into].size() + added.size());
      std::merge(tracks[into].begin(), tracks[into].end(), added.begin(), added.end(),
                 std::back_inserter(merged), ByImage);
      for (const TrackFeature& f : added) track_of[f.image][f.feature] = into;
      if (both) Track().swap(tracks[from]);
      tracks[into] = std::move(merged);
    }
  }
  std::erase_if(tracks, [](const Track& track) { return track.size() < 2; });
  std::sort(tracks.begin(), tracks.end(), [](const Track& x, const Track& y) {
    return x[0].image != y[0].image ? x[0].image < y[0].image : x[0].feature < y[0].feature;
  });
  return tracks;
}

}  // namespace dtr::sfm
