#include "calib/sfm/mapping/repetition.h"

namespace dtr::sfm {
namespace {

constexpr int kNoPoint = -1;
// Features nearer to each other may be one corner found at two scales.
constexpr double kTwoPlacesPx = 12;
// Chance puts fewer of the matches of a wrong pair on points that are two.
constexpr int kEnoughSeen = 10;
constexpr double kEnoughShare = 0.5;

}  // namespace

Repetition::Repetition(const ViewGraph& graph, std::span<const MapPoint> points)
    : graph_(graph), points_(points) {
  for (const GraphImage& image : graph.images) point_of_.emplace_back(image.pixels.size(), kNoPoint);
  for (size_t p = 0; p < points.size(); ++p) {
    for (const TrackFeature& f : points[p].seen) {
      point_of_[static_cast<size_t>(f.image)][f.feature] = static_cast<int>(p);
    }
  }
}

bool Repetition::SeenTogether(int point, int other) const {
  const Track& a = points_[static_cast<size_t>(point)].seen;
  const Track& b = points_[static_cast<size_t>(other)].seen;
  for (size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    if (a[i].image != b[k].image) {
      a[i].image < b[k].image ? ++i : ++k;
      continue;
    }
    const GraphImage& image = graph_.images[static_cast<size_t>(a[i].image)];
    if ((image.pixels[a[i].feature] - image.pixels[b[k].feature]).norm() > kTwoPlacesPx) {
      return true;
    }
    ++i, ++k;
  }
  return false;
}

TwinMatches Repetition::Of(const PairGeometry& pair) const {
  TwinMatches twins;
  for (const auto& [feature_a, feature_b] : pair.matches) {
    const int a = point_of_[static_cast<size_t>(pair.image_a)][feature_a];
    const int b = point_of_[static_cast<size_t>(pair.image_b)][feature_b];
    if (a == kNoPoint || b == kNoPoint || a == b) continue;
    ++twins.of_two_points;
    twins.seen_together += SeenTogether(a, b) ? 1 : 0;
  }
  return twins;
}

bool Repetition::Explains(const PairGeometry& pair) const {
  const TwinMatches twins = Of(pair);
  return twins.seen_together >= kEnoughSeen &&
         twins.seen_together >= kEnoughShare * twins.of_two_points;
}

}  // namespace dtr::sfm
