#include "dtr/gl/view_mesh.h"

#include <algorithm>
#include <array>

#include "dtr/base/error.h"
#include "dtr/render/closed_cells.h"
#include "dtr/render/scene.h"
#include "dtr/render/triangulation.h"

namespace dtr::gl {
namespace {

// Side of the squares in which blocks are listed: 13 x 13 vertices of a tile fit the caches of
// transformed vertices that drivers have (llvmpipe: 256; a row of the whole map fits none).
constexpr int kTileBlocks = 12;

class MeshMaker {
 public:
  MeshMaker(const View& view, const RenderOptions& options)
      : samples_(MakeSampleGrid(view, options.resolution)), rule_(BreakRuleOf(view, options)) {}

  ViewMesh Make() {
    const Grid<double>& w = samples_.inverse_depth;
    if (w.empty()) return {};
    const size_t count = w.data().size();
    mesh_.points.reserve(3 * count);
    mesh_.indices.reserve(6 * count);
    for (int j = 0; j < w.height(); ++j) {
      for (int i = 0; i < w.width(); ++i)
        AddPoint({samples_.Centre(i), samples_.Centre(j), w(i, j)});
    }
    // Blocks reach one sample beyond the grid: its border cells are closed too (SPEC 2.6).
    for (int top = -1; top < w.height(); top += kTileBlocks) {
      for (int left = -1; left < w.width(); left += kTileBlocks) AddTile(left, top);
    }
    return std::move(mesh_);
  }

 private:
  bool Exists(int i, int j) const {
    return samples_.inverse_depth.Contains(i, j) && samples_.inverse_depth(i, j) > 0;
  }
  std::uint32_t AddPoint(const SurfacePoint& point) {
    mesh_.points.push_back(static_cast<float>(point.u));
    mesh_.points.push_back(static_cast<float>(point.v));
    mesh_.points.push_back(static_cast<float>(point.inverse_depth));
    return static_cast<std::uint32_t>(mesh_.points.size() / 3 - 1);
  }

  /// Tile by tile, so that a vertex is in a cache when its neighbours below are drawn.
  void AddTile(int left, int top) {
    const Grid<double>& w = samples_.inverse_depth;
    for (int j = top; j < std::min(top + kTileBlocks, w.height()); ++j) {
      for (int i = left; i < std::min(left + kTileBlocks, w.width()); ++i) AddBlock(i, j);
    }
  }

  void AddBlock(int i, int j) {
    const Grid<double>& w = samples_.inverse_depth;
    const bool inside = i >= 0 && j >= 0 && i + 1 < w.width() && j + 1 < w.height();
    const BlockTriangles block = inside ? TrianglesOfBlock(w, i, j, rule_) : BlockTriangles{};
    for (const std::uint8_t corners : block.corners) {
      if (corners != 0) AddTriangle(i, j, corners);
    }
    const std::uint8_t open = OpenCorners(block);
    for (int c = 0; open != 0 && c < 4; ++c) {
      const int x = i + (c & 1), y = j + (c >> 1);
      if ((open & (1 << c)) && Exists(x, y)) AddCell(x, y, c);
    }
  }

  void AddTriangle(int i, int j, std::uint8_t corners) {
    // A B D C without the missing corner is clockwise, y down.
    for (const int c : {0, 1, 3, 2}) {
      if (!(corners & (1 << c))) continue;
      const int x = i + (c & 1), y = j + (c >> 1);
      mesh_.indices.push_back(static_cast<std::uint32_t>(y) *
                                  static_cast<std::uint32_t>(samples_.inverse_depth.width()) +
                              static_cast<std::uint32_t>(x));
    }
  }

  void AddCell(int x, int y, int corner) {
    std::array<std::uint32_t, 4> index{};
    const auto cell = QuarterCell(samples_, x, y, corner, rule_);
    for (size_t k = 0; k < 4; ++k) index[k] = AddPoint(cell[k]);
    mesh_.indices.insert(mesh_.indices.end(),
                         {index[0], index[1], index[3], index[0], index[3], index[2]});
  }

  const SampleGrid samples_;
  const BreakRule rule_;
  ViewMesh mesh_;
};

}  // namespace

ViewMesh MakeViewMesh(const View& view, const RenderOptions& options) {
  return MeshMaker(view, options).Make();
}

std::vector<float> MakeSplats(const View& view, const RenderOptions& options) {
  const SampleGrid samples = MakeSampleGrid(view, options.resolution);
  const BreakRule rule = BreakRuleOf(view, options);
  const Grid<double>& w = samples.inverse_depth;
  std::vector<float> splats;
  splats.reserve(5 * w.data().size());
  for (int j = 0; j < w.height(); ++j) {
    for (int i = 0; i < w.width(); ++i) {
      if (!(w(i, j) > 0)) continue;
      for (const double value :
           {samples.Centre(i), samples.Centre(j), w(i, j), LocalSlope(w, i, j, 1, 0, rule),
            LocalSlope(w, i, j, 0, 1, rule)}) {
        splats.push_back(static_cast<float>(value));
      }
    }
  }
  return splats;
}

}  // namespace dtr::gl
