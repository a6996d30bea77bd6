// dtr/advise/advise.h -- where a capture lacks a camera, and which of its cameras add nothing.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "dtr/advise/coarse_view.h"
#include "dtr/base/progress.h"

namespace dtr::advise {

struct AdviseOptions {
  /// A place is poor where no photo shows more than this share of what it sees ...
  double max_unseen = 0.05;
  /// ... or where the nearest photo that shows a point stands further off than this, seen from the
  /// point, for more than a twentieth of the points. Beyond some 15 degrees reflections and what a
  /// depth map has wrong are no longer the same from both places.
  double max_gap_deg = 15;
  /// A camera adds nothing where others show this share of its points, as large and from nearby.
  double redundant_share = 0.99;
  int max_cameras_to_add = 5;
};

/// A place from which people will look, and what the photos know of what it sees.
struct Place {
  std::string where;  ///< "between a.jpg and b.jpg", "beyond a.jpg, away from b.jpg", "near a.jpg"
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;

  double seen_share = 0;       ///< pixels whose surface some photo shows
  double depthless_share = 0;  ///< some photo looks there and has no depth: sky, plain walls
  double unseen_share = 0;     ///< no photo looks there
  double single_share = 0;     ///< of the seen: one photo only, nothing to check its depth by
  double gap_deg = 0;          ///< 95 % of the seen points have a photo within this angle
  bool poor = false;           ///< by AdviseOptions
};

/// What makes a place poor, in words: "12 % of what it sees is in no photo", "what it sees is up to
/// 17 degrees from the nearest photo", or both; empty where it is not poor.
std::string WhyPoor(const Place& place, const AdviseOptions& options);

/// A camera that should be added: `place` index and how many poor places it leaves.
struct Addition {
  size_t place = 0;
  int poor_before = 0, poor_after = 0;
};

struct Redundant {
  std::string name;
  double covered_share = 0;  ///< of its points, by the cameras that stay
};

struct Advice {
  /// Between neighbours, and a step beyond each camera. A redundant one goes by the name of the
  /// nearest that is none.
  std::vector<Place> places;
  std::vector<Addition> add;         ///< in this order: each counts those before it as taken
  std::vector<Redundant> redundant;  ///< may all be left out together, in this order
};

/// Redundant cameras are taken out one by one, the most covered first. Then looks from half-way
/// between neighbouring cameras, and from half a step beyond each, by what those show that stay: so
/// all of the advice can be followed together. The rest is geometry: nothing is rendered.
/// Cameras to add are chosen one by one where a camera would leave
/// the fewest poor places, as far as the known surfaces tell what it would see. Deterministic.
/// Throws std::invalid_argument for fewer than 2 views.
Advice Advise(std::span<const CoarseView> views, const AdviseOptions& options, Progress& progress);

/// Samples along the long side of the coarse views that Advise is meant for.
inline constexpr int kCoarseSidePx = 160;

}  // namespace dtr::advise
