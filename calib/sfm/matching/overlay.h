// calib/sfm/matching/overlay.h -- features of what was drawn over photos.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/matching/match_photos.h"
#include "calib/sfm/matching/pair_choice.h"

namespace dtr::sfm::matching {

/// Features of a watermark, a date, a logo or a frame drawn over the photos, which show nothing of
/// the scene: they lie at the same position in both photos of pairs whose other matches moved.
struct Overlay {
  std::vector<std::vector<bool>> of_photo;  ///< per photo and feature; empty: none
  std::string note;                         ///< one line for people
};

/// A feature is taken for one where its matches lie at the same position (0.15 % of the long side)
/// in 3 pairs or more, and moved in a third as many at most. Pairs count in which a quarter of the
/// matches or more moved, half of those by 5 % of the long side: where a camera hardly moved, the
/// scene of its photos does not, either. Where fewer than
/// 5 % of the matches are of such features, outlier tests deal with them, and none is named.
Overlay FindOverlay(std::span<const MatchPhoto> photos, std::span<const calib::LensCamera> cameras,
                    std::span<const CoarsePair> pairs);

/// The matches without those of the overlay.
void RemoveOverlay(const Overlay& overlay, std::vector<CoarsePair>& pairs);

/// The features' positions, NaN of those of the overlay.
std::vector<Keypoint> WithoutOverlay(const Overlay& overlay, int photo,
                                     const std::vector<Keypoint>& keypoints);

}  // namespace dtr::sfm::matching
