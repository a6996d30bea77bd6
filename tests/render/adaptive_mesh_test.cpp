#include "dtr/render/adaptive_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr {
namespace {

constexpr double kTolerance = 0.5, kBreak = 1;  // of 1/z; as many pixels where fx b = 1

SampleGrid Samples(int columns, int rows, const std::function<double(int, int)>& inverse_depth) {
  SampleGrid samples;
  samples.inverse_depth = Grid<double>(columns, rows);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) samples.inverse_depth(x, y) = inverse_depth(x, y);
  }
  return samples;
}

AdaptiveMesh MeshOf(const SampleGrid& samples, int threads = 1) {
  const BreakRule rule{kBreak, std::nullopt};
  return MakeAdaptiveMesh(samples, rule, OnThreads(threads, [&] {
                            return CoverBlocks(samples.inverse_depth, rule, kTolerance);
                          }));
}

/// Hills with noise, everywhere connected: neighbours differ by less than kBreak.
double Hills(int x, int y) {
  const double noise = 0.3 * std::sin(12.9898 * x + 78.233 * y + 0.1 * x * y);
  return 100 + 3 * std::sin(0.11 * x) * std::cos(0.07 * y) + (x > 60 && y > 40 ? noise : 0);
}

/// Everything in one: hills, a square before them, holes and lone samples.
double Clutter(int x, int y) {
  if (x > 20 && x < 45 && y > 10 && y < 33) return 140 + 0.2 * x;
  if (x > 50 && x < 58 && y > 5 && y < 20) return (x + 2 * y) % 5 == 0 ? 90 : 0;
  return Hills(x, y);
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// How often each directed edge occurs.
std::map<Edge, int> EdgesOf(const AdaptiveMesh& mesh) {
  std::map<Edge, int> edges;
  for (size_t t = 0; t < mesh.indices.size(); t += 3) {
    for (size_t k = 0; k < 3; ++k) ++edges[{mesh.indices[t + k], mesh.indices[t + (k + 1) % 3]}];
  }
  return edges;
}

double TwiceArea(const AdaptiveMesh& mesh, size_t first_index) {
  const auto& a = mesh.vertices[mesh.indices[first_index]];
  const auto& b = mesh.vertices[mesh.indices[first_index + 1]];
  const auto& c = mesh.vertices[mesh.indices[first_index + 2]];
  return double(b.x - a.x) * (c.y - a.y) - double(b.y - a.y) * (c.x - a.x);
}

/// Calls visit(x, y, w) for every sample inside or on a triangle.
template <typename Visit>
void ForEachSampleOf(const AdaptiveMesh& mesh, size_t first_index, const Visit& visit) {
  const AdaptiveMesh::Vertex* v[3];
  for (size_t k = 0; k < 3; ++k) v[k] = &mesh.vertices[mesh.indices[first_index + k]];
  const auto [x0, x1] = std::minmax({v[0]->x, v[1]->x, v[2]->x});
  const auto [y0, y1] = std::minmax({v[0]->y, v[1]->y, v[2]->y});
  const double area = TwiceArea(mesh, first_index);
  for (int y = y0 / 2; 2 * y + 1 <= y1; ++y) {
    for (int x = x0 / 2; 2 * x + 1 <= x1; ++x) {
      double weight[3];
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        const auto &p = *v[(k + 1) % 3], &q = *v[(k + 2) % 3];
        weight[k] =
            (double(q.x - p.x) * (2 * y + 1 - p.y) - double(q.y - p.y) * (2 * x + 1 - p.x)) / area;
        inside = inside && weight[k] >= 0;
      }
      if (!inside) continue;
      double w = 0;
      for (int k = 0; k < 3; ++k) w += weight[k] * v[k]->inverse_depth;
      visit(x, y, w);
    }
  }
}

TEST(AdaptiveMesh, APlaneTakesTwoTrianglesARootSquare) {
  const AdaptiveMesh mesh = MeshOf(Samples(33, 17, [](int x, int y) { return 50 + 2.0 * x - y; }));
  EXPECT_EQ(mesh.indices.size(), 3u * 4);
  EXPECT_TRUE(mesh.cells.empty());
}

TEST(AdaptiveMesh, HasNoCracksBetweenRectanglesOfDifferentSize) {
  const SampleGrid samples = Samples(131, 97, Hills);
  const AdaptiveMesh mesh = MeshOf(samples);
  EXPECT_LT(mesh.indices.size() / 3, 130u * 96);
  const auto edges = EdgesOf(mesh);
  const auto on_border = [&](std::uint32_t p, std::uint32_t q) {
    const auto &a = mesh.vertices[p], &b = mesh.vertices[q];
    return (a.x == b.x && (a.x == 0 || a.x == 2 * 131)) ||
           (a.y == b.y && (a.y == 0 || a.y == 2 * 97));
  };
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_NE(edges.contains({edge.second, edge.first}), on_border(edge.first, edge.second));
  }
  // Whole: the triangles tile the map up to its border, once.
  double area = 0;
  for (size_t t = 0; t < mesh.indices.size(); t += 3) {
    EXPECT_GT(TwiceArea(mesh, t), 0);
    area += TwiceArea(mesh, t);
  }
  EXPECT_EQ(area, 2 * (2 * 131) * (2 * 97));
}

TEST(AdaptiveMesh, LiesNearEverySampleAndCrossesNoBreak) {
  const SampleGrid samples = Samples(131, 97, Clutter);
  const Grid<double>& w = samples.inverse_depth;
  const AdaptiveMesh mesh = MeshOf(samples);
  Grid<std::uint8_t> seen(131, 97);
  // Rectangles lie within the tolerance; vertices of their smaller neighbours on their borders may
  // lift a fan as far again. Borders pushed out to the cells' edges follow the samples' own slopes.
  constexpr double kLargest = 2 * kTolerance + 1e-4;
  for (size_t t = 0; t < mesh.indices.size(); t += 3) {
    ForEachSampleOf(mesh, t, [&](int x, int y, double on_mesh) {
      ASSERT_GT(w(x, y), 0);
      EXPECT_NEAR(on_mesh, w(x, y), kLargest) << x << ' ' << y;
      seen(x, y) = 1;
    });
  }
  for (const auto& cell : mesh.cells) {
    const int x = (cell.x - 1) / 2, y = (cell.y - 1) / 2;
    EXPECT_EQ(seen(x, y), 0);
    EXPECT_EQ(cell.inverse_depth, static_cast<float>(w(x, y)));
    seen(x, y) = 1;
  }
  EXPECT_FALSE(mesh.cells.empty());
  for (int y = 0; y < 97; ++y) {
    for (int x = 0; x < 131; ++x) EXPECT_EQ(seen(x, y) != 0, w(x, y) > 0) << x << ' ' << y;
  }
}

TEST(AdaptiveMesh, TilesHoldEverythingOnceWithinTheirBounds) {
  const AdaptiveMesh mesh = MeshOf(Samples(131, 97, Clutter));
  const auto within = [](const AdaptiveMesh::Range& range, double value) {
    return range.low <= value && value <= range.high;
  };
  int triangles = 0, cells = 0;
  for (const AdaptiveMesh::Tile& tile : mesh.tiles) {
    EXPECT_EQ(tile.first_triangle, triangles);
    EXPECT_EQ(tile.first_cell, cells);
    triangles += tile.triangle_count;
    cells += tile.cell_count;
    for (int i = 3 * tile.first_triangle; i < 3 * triangles; ++i) {
      const auto& v = mesh.vertices[mesh.indices[static_cast<size_t>(i)]];
      EXPECT_TRUE(within(tile.x, v.x) && within(tile.y, v.y) &&
                  within(tile.inverse_depth, v.inverse_depth));
    }
    for (int i = tile.first_cell; i < cells; ++i) {
      const auto& cell = mesh.cells[static_cast<size_t>(i)];
      EXPECT_TRUE(within(tile.x, cell.x) && within(tile.y, cell.y) &&
                  within(tile.inverse_depth, cell.inverse_depth) &&
                  within(tile.slope_x, cell.slope_x) && within(tile.slope_y, cell.slope_y));
    }
  }
  EXPECT_EQ(3 * static_cast<size_t>(triangles), mesh.indices.size());
  EXPECT_EQ(static_cast<size_t>(cells), mesh.cells.size());
}

TEST(AdaptiveMesh, DoesNotDependOnTheNumberOfThreads) {
  const SampleGrid samples = Samples(200, 170, Clutter);
  const BreakRule rule{kBreak, std::nullopt};
  const BlockCover one =
      OnThreads(1, [&] { return CoverBlocks(samples.inverse_depth, rule, kTolerance); });
  const BlockCover many =
      OnThreads(5, [&] { return CoverBlocks(samples.inverse_depth, rule, kTolerance); });
  EXPECT_EQ(one.rectangles, many.rectangles);
}

TEST(AdaptiveMesh, RejectsTheCoverOfAnotherDepthMap) {
  const SampleGrid samples = Samples(40, 40, Hills);
  const BreakRule rule{kBreak, std::nullopt};
  const BlockCover cover = CoverBlocks(samples.inverse_depth, rule, kTolerance);
  EXPECT_THROW(MakeAdaptiveMesh(Samples(40, 39, Hills), rule, cover), Error);
  const auto with_hole = [](int x, int y) { return x == 16 && y == 16 ? 0 : Hills(x, y); };
  EXPECT_THROW(MakeAdaptiveMesh(Samples(40, 40, with_hole), rule, cover), Error);
}

TEST(AdaptiveMesh, AStoredCoverOfAnotherDepthMapIsMadeAnewAndNamed) {
  View view;
  view.camera = PinholeCamera(40, 40, 40, 40, 20, 20);
  view.reference_baseline = 1.0 / 40;  // a pixel of disparity is 1 of 1/z
  const auto photograph = [&](double (*w)(int, int)) {
    view.depth = DepthImage(40, 40);
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) {
        view.depth(x, y) = w(x, y) > 0 ? static_cast<float>(1 / w(x, y)) : 0;
      }
    }
  };
  photograph(Hills);
  view.mesh = MakeStoredMesh(view, {});
  std::string unfit = "?";
  const AdaptiveMesh stored = MakeAdaptiveMesh(view, {}, unfit);
  EXPECT_EQ(unfit, "");
  photograph([](int x, int y) { return x == 16 && y == 16 ? 0 : Hills(x, y); });
  const AdaptiveMesh anew = MakeAdaptiveMesh(view, {}, unfit);
  EXPECT_NE(unfit, "");
  view.mesh.reset();
  const AdaptiveMesh without = MakeAdaptiveMesh(view, {}, unfit);
  EXPECT_EQ(unfit, "");
  EXPECT_EQ(anew.indices, without.indices);
  EXPECT_NE(anew.indices, stored.indices);
}

TEST(AdaptiveMesh, MapsTooSmallForBlocksAreCells) {
  EXPECT_TRUE(MeshOf(SampleGrid{}).tiles.empty());
  const AdaptiveMesh line = MeshOf(Samples(5, 1, Hills));
  EXPECT_EQ(line.cells.size(), 5u);
  EXPECT_TRUE(line.indices.empty());
}

}  // namespace
}  // namespace dtr
