// dtr/render/adaptive_mesh.h -- SPEC 5.1: a view's surface with as few triangles as its depth
// allows.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "dtr/render/block_cover.h"
#include "dtr/render/options.h"
#include "dtr/render/triangulation.h"
#include "dtr/types/view.h"

namespace dtr {

/// What is drawn of a view. Watertight: a vertex on the border of a triangle is a vertex of every
/// triangle there, so that surfaces that hold together on the full grid (SPEC 2.2) leave no crack
/// at any camera, whatever the sizes of the rectangles. Where a surface ends, its border is moved
/// out to the edge of the outermost cells (SPEC 2.6).
struct AdaptiveMesh {
  /// Positions count half samples from the edge of the first cell: sample (i, j)'s centre is
  /// (2 i + 1, 2 j + 1).
  struct Vertex {
    std::uint16_t x = 0, y = 0;
    float inverse_depth = 0;  ///< 1 / scene units
  };
  /// The cell (SPEC 2.6) of a sample that no rectangle holds.
  struct Cell {
    std::uint16_t x = 0, y = 0;
    float inverse_depth = 0;
    float slope_x = 0, slope_y = 0;  ///< of 1/z per sample, as LocalSlope
  };
  struct Range {
    float low = 0, high = 0;
  };
  /// What lies in a square of kTileSide samples: left out together where it cannot be seen.
  struct Tile {
    int first_triangle = 0, triangle_count = 0;
    int first_cell = 0, cell_count = 0;
    Range x, y;                             ///< of its vertices and of its cells' centres
    Range inverse_depth, slope_x, slope_y;  ///< slopes of triangles and cells, per sample
  };
  static constexpr int kTileSide = 64;

  int columns = 0, rows = 0, step = 1, offset = 0;  ///< the samples, as SampleGrid
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;  ///< 3 a triangle, clockwise on the view's screen (y down)
  std::vector<Cell> cells;
  std::vector<Tile> tiles;  ///< without empty ones; together all triangles and cells, in order

  /// Position on the depth grid, in its pixels, of a number of half samples along an axis.
  double DepthPixel(int half_samples) const {
    return offset + 0.5 + 0.5 * (half_samples - 1) * static_cast<double>(step);
  }
};

/// Thresholds of a mesh, as differences of 1/z but for the absolute rule.
struct MeshRule {
  BreakRule breaks;
  double tolerance = 0;
  bool operator==(const MeshRule&) const = default;
};
MeshRule MeshRuleOf(const View& view, const RenderOptions& options);

/// The mesh of the samples for a cover that was made from them, or from equal ones. Rectangles
/// beside smaller ones are fans that take in the vertices on their border. Throws dtr::Error where
/// the cover is of another grid or holds what is no sample (not of this depth map), and for grids
/// of more than 32767 samples a side.
AdaptiveMesh MakeAdaptiveMesh(const SampleGrid& samples, const BreakRule& rule,
                              const BlockCover& cover);

/// Of the view's depth with these options. The view's stored cover serves where it is of this rule
/// and resolution; else one is made, on `threads` as ParallelFor. The mesh is the same either way.
/// A stored cover that does not fit the depth map is left out, too, and `unfit` says why ("" else).
AdaptiveMesh MakeAdaptiveMesh(const View& view, const RenderOptions& options, std::string& unfit);

/// What a set keeps of it; the hashes are the writer's to fill in.
StoredMesh MakeStoredMesh(const View& view, const RenderOptions& options);

}  // namespace dtr
