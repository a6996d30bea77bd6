// dtr/prune/tiles.h -- tiles of views that better views cover, and a view without them.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "dtr/prune/cover.h"
#include "dtr/types/view.h"

namespace dtr::prune {

/// Which tiles are left out: by view id, a value for each tile of its TileGrid, row by row, 1: it
/// is. Views that keep all are not in it.
using TilesLeftOut = std::map<std::string, std::vector<std::uint8_t>>;

/// When a tile is redundant: each of its places is covered by `coverers` tiles that stay, whose
/// colours lie within `levels` of its own (8-bit values, root mean square over the tile).
struct TileRule {
  int coverers = 2;
  double levels = 8;
};

/// The redundant tiles, one view after the other, the one first that others cover most (MIV's
/// pruning graph: its children). A tile that is left out covers nothing, and one that others rely
/// on stays: the graph has no cycles. Tiles of which a twentieth or more is not covered or has no
/// depth stay too; masked pixels do not count. Does not depend on the order of the set's views.
TilesLeftOut RedundantTiles(const CoverMap& map, const TileRule& rule);

/// The view without these tiles: masked, without depth, all of one colour (their mean, so that they
/// take nearly nothing on disk). A renderer then passes their weights on: shares are of the views
/// that are left (SPEC 4.7), and where a view is masked it has no say in SPEC 5.2 either.
View WithoutTiles(const View& view, const std::vector<std::uint8_t>& left_out);

/// Of so many tiles, the share that is left out.
double ShareOf(const TilesLeftOut& left_out, size_t tiles);

}  // namespace dtr::prune
