#include "calib/sfm/matching/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dtr/base/order_statistics.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kStillShare = 0.0015;  // of the long side
constexpr size_t kMinMoved = 30;        // matches of a pair that moved
constexpr double kMovedShare = 0.05;    // of the long side, by at least half of them
constexpr int kMinPairs = 3;            // in which a feature did not move
constexpr double kMinShare = 0.05;      // of all matches

struct Counts {
  int still = 0, moved = 0;
  bool IsOverlay() const { return still >= kMinPairs && still >= 3 * moved; }
};

using Tally = std::vector<std::vector<Counts>>;

// A pair of photos of one size.
class SameSize {
 public:
  SameSize(std::span<const MatchPhoto> photos, std::span<const calib::LensCamera> cameras,
           const CoarsePair& pair)
      : a_(photos[static_cast<size_t>(pair.a)]), b_(photos[static_cast<size_t>(pair.b)]) {
    const calib::LensCamera& first = cameras[static_cast<size_t>(a_.camera)];
    const calib::LensCamera& second = cameras[static_cast<size_t>(b_.camera)];
    if (first.width_px != second.width_px || first.height_px != second.height_px) return;
    long_side_px_ = std::max(first.width_px, first.height_px);
  }
  bool IsStill(const CoarseMatch& match) const {
    return DisplacementPx(match) < kStillShare * long_side_px_;
  }
  // Whether enough of the scene moved far enough: what is far away moves little, too.
  bool SomethingMoved(const std::vector<CoarseMatch>& matches) const {
    if (long_side_px_ == 0) return false;
    std::vector<double> moved_px;
    for (const CoarseMatch& match : matches) {
      if (!IsStill(match)) moved_px.push_back(DisplacementPx(match));
    }
    return moved_px.size() >= kMinMoved && 4 * moved_px.size() >= matches.size() &&
           UpperMedian(moved_px) >= kMovedShare * long_side_px_;
  }

 private:
  double DisplacementPx(const CoarseMatch& match) const {
    const Keypoint& p = a_.features.keypoints[static_cast<size_t>(match.a)];
    const Keypoint& q = b_.features.keypoints[static_cast<size_t>(match.b)];
    return std::hypot(p.x_px - q.x_px, p.y_px - q.y_px);
  }

  const MatchPhoto& a_;
  const MatchPhoto& b_;
  int long_side_px_ = 0;  // 0: of two sizes
};

}  // namespace

Overlay FindOverlay(std::span<const MatchPhoto> photos, std::span<const calib::LensCamera> cameras,
                    std::span<const CoarsePair> pairs) {
  Tally tally;
  for (const MatchPhoto& photo : photos) tally.emplace_back(photo.features.keypoints.size());
  size_t matches = 0;
  for (const CoarsePair& pair : pairs) {
    const SameSize photos_of(photos, cameras, pair);
    if (!photos_of.SomethingMoved(pair.matches)) continue;
    matches += pair.matches.size();
    for (const CoarseMatch& match : pair.matches) {
      Counts& a = tally[static_cast<size_t>(pair.a)][static_cast<size_t>(match.a)];
      Counts& b = tally[static_cast<size_t>(pair.b)][static_cast<size_t>(match.b)];
      const bool is_still = photos_of.IsStill(match);
      ++(is_still ? a.still : a.moved);
      ++(is_still ? b.still : b.moved);
    }
  }
  Overlay overlay;
  size_t of_overlay = 0, with_overlay = 0;  // ends of matches; photos
  for (const std::vector<Counts>& features : tally) {
    std::vector<bool>& is_overlay = overlay.of_photo.emplace_back(features.size());
    for (size_t i = 0; i < features.size(); ++i) {
      is_overlay[i] = features[i].IsOverlay();
      if (is_overlay[i]) of_overlay += static_cast<size_t>(features[i].still);
    }
    with_overlay += std::find(is_overlay.begin(), is_overlay.end(), true) != is_overlay.end();
  }
  const double share =
      matches > 0 ? static_cast<double>(of_overlay) / (2 * static_cast<double>(matches)) : 0;
  if (share < kMinShare) return {};
  overlay.note = fmt::format(
      "{:.0f} % of the matches, in {} photos, are of features that keep their position in the "
      "photo while others move (text, a logo or a frame drawn over it, or what moves with the "
      "camera): left out",
      100 * share, with_overlay);
  return overlay;
}

void RemoveOverlay(const Overlay& overlay, std::vector<CoarsePair>& pairs) {
  if (overlay.of_photo.empty()) return;
  for (CoarsePair& pair : pairs) {
    const std::vector<bool>& a = overlay.of_photo[static_cast<size_t>(pair.a)];
    const std::vector<bool>& b = overlay.of_photo[static_cast<size_t>(pair.b)];
    std::erase_if(pair.matches, [&](const CoarseMatch& match) {
      return a[static_cast<size_t>(match.a)] || b[static_cast<size_t>(match.b)];
    });
  }
}

std::vector<Keypoint> WithoutOverlay(const Overlay& overlay, int photo,
                                     const std::vector<Keypoint>& keypoints) {
  std::vector<Keypoint> left = keypoints;
  if (overlay.of_photo.empty()) return left;
  const std::vector<bool>& is_overlay = overlay.of_photo[static_cast<size_t>(photo)];
  for (size_t i = 0; i < left.size(); ++i) {
    if (is_overlay[i]) left[i].x_px = left[i].y_px = std::numeric_limits<float>::quiet_NaN();
  }
  return left;
}

}  // namespace dtr::sfm::matching
