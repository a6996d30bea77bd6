// dtr/prune/coding.h -- how a set's views are stored, and what that takes.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dtr/prune/tiles.h"
#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr::prune {

/// Of all source views alike, but for the tiles.
struct Coding {
  int jpeg_quality = 0;       ///< of images; 0: as they are
  double depth_error_px = 0;  ///< bound in pixels of disparity; 0: as it is
  int shrink = 1;             ///< images and depth maps are 1/shrink of their size per axis
  double mesh_tolerance_px =
      RenderOptions{}.mesh_tolerance_px;  ///< of the reduced meshes beside them
  int mesh_resolution = 1;                ///< these are of every so many samples per axis
  bool sigma = true;                      ///< false: no standard deviations
  TilesLeftOut tiles;
  /// The tiles of one view; null: it keeps all.
  const std::vector<std::uint8_t>* TilesOf(const View& view) const {
    const auto found = tiles.find(view.id);
    return found == tiles.end() ? nullptr : &found->second;
  }
  bool operator==(const Coding&) const = default;
};

/// The set as whoever reads it will find it, pixels loaded, and what each view of its first frame
/// takes on disk; held-out views 0.
struct CodedSet {
  DtrSet set;
  std::vector<std::uint64_t> bytes;
};
/// Stores the original in another way and gives back what a reader would get.
using CodeFunction = std::function<CodedSet(const Coding& coding)>;

/// True where every view with depth is divided by it on both axes, image and depth map.
bool CanShrink(const DtrSet& set, int shrink);

/// The view at 1/`shrink` of its size: image and mask by areas, depth by Shrunk, camera with K
/// scaled; no sigma and no mesh. Requires CanShrink.
View ShrunkView(const View& view, int shrink);

/// A depth map at 1/`shrink`: per block the inverse depth of the surface that most of its samples
/// lie on (the nearer one where two tie): their mean, exact on planes. Samples lie on one surface
/// where their 1/z differ by at most `depth_break`. A hole where less than half of a block has
/// depth.
DepthImage ShrunkDepth(const DepthImage& depth, int shrink, double depth_break);

}  // namespace dtr::prune
