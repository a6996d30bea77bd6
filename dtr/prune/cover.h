// dtr/prune/cover.h -- which views show what a view's tiles show: the edges of the pruning graph of
// MPEG Immersive Video (ISO/IEC 23090-12; Dore et al. 2020), between tiles instead of pixels.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dtr/types/dtr_set.h"

namespace dtr::prune {

/// How a view is divided: squares of `step_px` * 8 pixels of its depth map from the upper left
/// corner on, each looked at in 8x8 places.
struct TileGrid {
  int step_px = 4;  ///< a multiple of 4; larger for depth maps of more than 2^16 places
  int columns = 0, rows = 0;
  int size_px() const { return 8 * step_px; }
  int count() const { return columns * rows; }
};
TileGrid TileGridOf(const View& view);

/// Another view that shows what a view shows at a place.
struct Coverer {
  std::int32_t view = -1;        ///< index into CoverMap::views
  std::int32_t tile = -1;        ///< of that view, where the place lies
  float squared_difference = 0;  ///< of the colours there, 8-bit values, mean of the channels
};

inline constexpr int kMaxCoverers = 6;

/// A place of a view that has depth: its coverers, `count` of them.
struct CoveredPlace {
  std::int32_t tile = -1;
  std::uint8_t count = 0;
  std::array<Coverer, kMaxCoverers> coverers;
};

struct CoveredView {
  std::string id;
  TileGrid grid;
  std::vector<int> looked;  ///< per tile: places that are not masked, with depth or without
  std::vector<CoveredPlace> places;
};

/// What views show of each other. A view covers a place when it is one of the 6 nearest by angle,
/// its own depth lies within a pixel of disparity there, and its pixels are no more than 1.5 times
/// as coarse per axis: what it shows may take the place's place. Photos are compared after their
/// gains.
struct CoverMap {
  std::vector<CoveredView> views;  ///< source views, in byte order of their ids
};

/// `set`: loaded, a still scene; views in `without` (ids) are not there.
CoverMap WhoCovers(const DtrSet& set, const std::vector<std::string>& without);

}  // namespace dtr::prune
