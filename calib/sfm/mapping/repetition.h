// calib/sfm/mapping/repetition.h -- internal to calib/sfm/mapping: things that look alike and are
// known to be two.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/mapping/points.h"

namespace dtr::sfm {

/// What matches of a pair say of a map: those whose two features belong to two points of it, and of
/// these the ones whose points some photo shows both, at two places.
struct TwinMatches {
  int of_two_points = 0, seen_together = 0;
};

/// Whether a map that a pair contradicts explains why: wallpaper, windows and fences repeat, and
/// photos of one part of them match photos of another. That they are two parts, not one that the
/// map has torn in two, shows where one photo sees both. (Of one thing a photo cannot see two.)
class Repetition {
 public:
  /// Keeps references to both.
  Repetition(const ViewGraph& graph, std::span<const MapPoint> points);

  TwinMatches Of(const PairGeometry& pair) const;
  /// Whether enough of the pair's matches are of things that are known to be two.
  bool Explains(const PairGeometry& pair) const;

 private:
  bool SeenTogether(int point, int other) const;

  const ViewGraph& graph_;
  std::span<const MapPoint> points_;
  std::vector<std::vector<int>> point_of_;  // per image and feature; -1: none
};

}  // namespace dtr::sfm
