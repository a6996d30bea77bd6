// dtr/advise/look.h -- what the photos know of what a place sees.
#pragma once
#include <span>
#include <vector>

#include "dtr/advise/advise.h"

namespace dtr::advise {

/// One pixel of a place's image.
struct Glance {
  enum class What : std::uint8_t { kUnseen, kDepthless, kSeen };
  What what = What::kUnseen;
  int photos = 0;                                   ///< that show the surface
  float angle_rad = 0;                              ///< to the nearest of them, at the surface
  Eigen::Vector3f point = Eigen::Vector3f::Zero();  ///< surface; of unseen pixels a guess
};

/// A place's image, and the place as a view, its depth being what the photos make of it.
struct Look {
  std::vector<Glance> glances;  ///< row by row
  CoarseView view;
};

/// Draws the samples of the 16 nearest views as rectangles of their footprint into a depth buffer,
/// and asks all of these views for every surface point found. Pixels without one are depthless
/// where some view looks along their ray and has no depth.
Look LookFrom(const Place& place, std::span<const CoarseView> views);

/// The look once a photo was taken from `other` as well: that shows the surfaces it sees, and
/// unseen pixels whose guessed point it would look at.
void AddPhoto(const CoarseView& other, Look& look);

/// Fills the place's figures from its look.
void Measure(const Look& look, const AdviseOptions& options, Place& place);

}  // namespace dtr::advise
