#include "calib/sfm/run/parallax.h"

#include <fmt/format.h>

#include <algorithm>

namespace dtr::sfm {
namespace {

// A feature that moved by less than this share of the photo's long side lies at the same position:
// 1.2 px of 400, 12 px of 4000. Features are found to about a pixel of the photo they are found in,
// whose long side is 640 to 2400 px.
constexpr double kStillShare = 0.003;

bool HalfOrMore(int part, int whole) { return whole > 0 && 2 * part >= whole; }

}  // namespace

PairCounts CountPairs(const MatchSummary& matches) {
  PairCounts counts;
  counts.photos = static_cast<int>(matches.features.size());
  counts.matched = static_cast<int>(matches.pairs.size());
  for (const MatchSummary::Pair& pair : matches.pairs) {
    counts.still += pair.still;
    counts.without_parallax += pair.one_homography;
  }
  return counts;
}

bool AreStill(const std::vector<double>& moved_px, const SfmImageInput& photo) {
  const double limit_px = kStillShare * std::max(photo.width_px, photo.height_px);
  const auto still =
      std::count_if(moved_px.begin(), moved_px.end(), [&](double px) { return px < limit_px; });
  return HalfOrMore(static_cast<int>(still), static_cast<int>(moved_px.size()));
}

bool CameraStoodStill(const PairCounts& counts) { return HalfOrMore(counts.still, counts.matched); }

std::string LackOfParallax(const PairCounts& counts) {
  if (CameraStoodStill(counts)) {
    return fmt::format(
        "{} of {} matched pairs of photos show most of their common features at the same position "
        "in both: the camera did not move against what stands still (a turntable, a thing held "
        "into the image, or text and frames drawn over it); mask what stands still, by "
        "NAME_mask.png beside each NAME.jpg, black "
        "where the photo is not to be used; where nothing rotated, move the camera between photos",
        counts.still, counts.matched);
  }
  if (HalfOrMore(counts.without_parallax, counts.matched)) {
    return fmt::format(
        "{} of {} matched pairs of photos show no parallax: the camera only rotated, or all that "
        "they show lies in one plane or far away; take photos from different positions, each step "
        "about a tenth of the distance to the scene",
        counts.without_parallax, counts.matched);
  }
  return "";
}

std::string LackOfPairs(const PairCounts& counts) {
  if (counts.matched + 1 >= counts.photos) return "";
  return fmt::format(
      "too few pairs of photos have features in common ({} among {} photos); photos that are dark, "
      "noisy, blurred or small have few: give sharp, well exposed ones, in full size, that overlap "
      "by half",
      counts.matched, counts.photos);
}

std::string WhyNoModel(const PairCounts& counts) {
  if (std::string lack = LackOfParallax(counts); !lack.empty()) return lack;
  // A chain of photos has one pair less than photos: with fewer, they fall into parts.
  if (counts.matched >= counts.photos) {
    return fmt::format(
        "{} pairs of photos match, but no cameras agree with them; photos of several cameras or "
        "zoom settings need intrinsics of their own (`camera_per` folder or photo), and what moved "
        "between the photos a mask",
        counts.matched);
  }
  return "";
}

}  // namespace dtr::sfm
