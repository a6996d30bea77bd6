// dtr/types/block_cover.h -- how a reduced mesh divides a depth map (docs/RENDER_SPEC.md 5.1).
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace dtr {

/// Rectangles of samples' blocks that together cover what SPEC 2.2 draws of a depth map, but for
/// crumbs beside depth breaks. A list of whole numbers: depth itself stays in the depth map.
struct BlockCover {
  /// Everything lies in root squares of so many blocks a side.
  static constexpr int kRootSide = 16;

  /// The blocks from sample (x, y) to sample (x + width, y + height); none lacks a triangle.
  struct Rectangle {
    int x = 0, y = 0, width = 1, height = 1;
    bool operator==(const Rectangle&) const = default;
  };

  int columns = 0, rows = 0;          ///< samples
  std::vector<Rectangle> rectangles;  ///< root square by root square, row by row
};

/// A cover kept with the set, and what it was made from: it serves only where all of this is equal.
struct StoredMesh {
  std::string depth_sha256, mask_sha256;       ///< of the view's files; mask: "" where it has none
  int resolution = 1;                          ///< R
  double tolerance = 0, depth_break = 0;       ///< differences of 1/z, 1 / scene units
  std::optional<double> absolute_depth_break;  ///< scene units
  BlockCover cover;
};

}  // namespace dtr
