// dtr/render/closed_cells.h -- SPEC 2.6: what is drawn where a block lacks a triangle.
#pragma once
#include <array>
#include <cstdint>

#include "dtr/render/triangulation.h"

namespace dtr {

/// Slope of 1/z per sample along (dx, dy) at sample (x, y), which exists: the flatter of the two
/// sides whose edge holds, 0 where none does.
double LocalSlope(const Grid<double>& inverse_depth, int x, int y, int dx, int dy,
                  const BreakRule& rule);

/// Corners of a block (as BlockCorner bits) whose quarter cells must be drawn: none where both
/// triangles are, all but the one that a single triangle surrounds, else all four. Corners without
/// a sample are among them; they have no cell.
std::uint8_t OpenCorners(const BlockTriangles& block);

/// A point of a view's surface: position on the depth grid (pixels) and inverse depth.
struct SurfacePoint {
  double u = 0, v = 0, inverse_depth = 0;
};

/// The quarter of a sample's cell that lies in the block whose corner number `corner` (0...3 for
/// A B C D) the sample (x, y) is, on its local plane: its corners A B C D as in a block, so that
/// A B D and A D C are its triangles.
std::array<SurfacePoint, 4> QuarterCell(const SampleGrid& samples, int x, int y, int corner,
                                        const BreakRule& rule);

}  // namespace dtr
