// dtr/render/triangulation.h -- SPEC 2: the implied triangulation of a depth map and its breaks.
#pragma once
#include <cstdint>
#include <optional>

#include "dtr/render/options.h"
#include "dtr/types/grid.h"
#include "dtr/types/view.h"

namespace dtr {

/// The samples of a view that a renderer draws, SPEC 2.1: sample (i, j) is depth pixel
/// (offset + i step, offset + j step).
struct SampleGrid {
  Grid<double> inverse_depth;  ///< 1/z per sample, 1 / scene units; 0 where there is no sample
  /// 1 for samples that are no holes of the depth map alone: all image pixels of their cells are
  /// masked. Empty where there are none.
  Grid<std::uint8_t> masked;
  int step = 1;    ///< R, in depth pixels
  int offset = 0;  ///< R / 2
  /// Position of sample (i, j)'s centre on the depth grid: offset + 0.5 + i step, pixels.
  double Centre(int i) const { return offset + 0.5 + static_cast<double>(i) * step; }
};

/// SPEC 2.1. Holes and samples whose image pixels are all masked give 0. Empty grid when R leaves
/// no sample, or none of them has a depth.
SampleGrid MakeSampleGrid(const View& view, int resolution);

/// SPEC 2.3: when two neighbouring samples do not belong to one surface.
struct BreakRule {
  double inverse_depth = 0;              ///< scale-free threshold, a difference of 1/z
  std::optional<double> absolute_depth;  ///< the report's: largest difference of z, scene units
  bool operator==(const BreakRule&) const = default;
};
BreakRule BreakRuleOf(const View& view, const RenderOptions& options);

/// SPEC 2.3. True when the edge from sample (x, y) to (x + dx, y + dy), neither of them empty,
/// crosses a depth break. Differences of inverse depth up to the threshold never break; a steeper
/// edge holds only as part of a straight run of 4 samples (a slanted plane is straight in 1/z).
/// With the absolute rule the difference of z alone decides.
bool EdgeBreaks(const Grid<double>& inverse_depth, int x, int y, int dx, int dy,
                const BreakRule& rule);

/// Corners of the block of samples (x, y), (x+1, y), (x, y+1), (x+1, y+1), as bits.
enum BlockCorner : std::uint8_t { kA = 1, kB = 2, kC = 4, kD = 8 };  // A B above C D

/// SPEC 2.2. Up to two triangles of a block, each a set of three corners (0: not drawn). The block
/// is split along the diagonal whose ends differ less in 1/z (ties and two impossible diagonals:
/// A-D); a triangle with an empty corner or a broken edge is dropped.
struct BlockTriangles {
  std::uint8_t corners[2] = {0, 0};
};
BlockTriangles TrianglesOfBlock(const Grid<double>& inverse_depth, int x, int y,
                                const BreakRule& rule);

/// SPEC 5.3. True when the samples of a block belong to one surface: both its triangles are drawn.
/// x from -1 to width - 1 and y likewise: around the grid its outermost samples stand once more, so
/// that a block there is an edge or a single sample.
bool IsWholeBlock(const Grid<double>& inverse_depth, int x, int y, const BreakRule& rule);

/// SPEC 5.2. True when all samples of a block are masked: the view does not look there. x and y as
/// for IsWholeBlock.
bool IsMaskedBlock(const SampleGrid& samples, int x, int y);

}  // namespace dtr
