// SPEC 5.1 in dtr/simd: the rasteriser, and what is left out before drawing.
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/frame.h"
#include "dtr/render/grid_placement.h"
#include "dtr/simd/coarse_raster.h"
#include "tests/simd/parity_scenes.h"
#include "tests/support/instruction_sets.h"
#include "tests/support/on_threads.h"

namespace dtr::testing {
namespace {

/// All views' meshes on the screen of a camera.
struct Placed {
  std::vector<AdaptiveMesh> meshes;
  std::vector<simd::PlacedMesh> placed;

  Placed(const DtrSet& set, const PinholeCamera& novel, const Pose& novel_from_world) {
    for (const View& view : set.frames[0].views) {
      std::string unfit;
      meshes.push_back(MakeAdaptiveMesh(view, RenderOptions{}, unfit));
    }
    for (size_t i = 0; i < meshes.size(); ++i) {
      const View& view = set.frames[0].views[i];
      placed.push_back(
          {&meshes[i], PlaceGrid(view, meshes[i], PlaceView(view, novel_from_world), novel)});
    }
  }
};

std::vector<float> Raster(const std::vector<simd::PlacedMesh>& placed, const PinholeCamera& novel,
                          int threads) {
  simd::CoarseRaster raster;
  OnThreads(threads, [&] { return raster.Draw(placed, novel.width_px(), {0, novel.height_px()}); });
  return raster.nearest();
}

Pose RandomPose(Random& random, double spread) {
  const Eigen::Vector3d centre(random.Uniform(-spread, spread), random.Uniform(-spread, spread),
                               random.Uniform(-spread, spread));
  const Eigen::Vector3d target(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(4, 12));
  return LookAt(centre, target);
}

TEST(CoarseRaster, LeavesNoPixelInsideAContinuousSurfaceUncovered) {
  // A bumpy wall, everywhere connected; flat and rough parts make rectangles of all sizes.
  const Surface wall = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double t = (8 - o.z()) / d.z();
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d p = o + t * d;
      const double bump = p.x() > 0 ? 0.05 * std::sin(9 * p.x()) * std::sin(7 * p.y()) : 0;
      t = (8 + bump - o.z()) / d.z();
    }
    return t;
  };
  const DtrSet set = FromAround(wall, 3, 0.4, {0, 0, 8});
  const Placed one(SetOf({set.frames[0].views[0]}), {1, 1, 1, 1, 0, 0}, Pose{});
  EXPECT_GT(one.meshes[0].indices.size() / 3, 50u);  // not one plane
  Random random(5);
  int covered = 0;
  for (int i = 0; i < 40; ++i) {
    const double focal = random.Uniform(60, 900);
    const PinholeCamera novel(120, 90, focal, focal, 60, 45);
    const Placed placed(SetOf({set.frames[0].views[0]}), novel, RandomPose(random, 1.5));
    const std::vector<float> nearest = Raster(placed.placed, novel, 1);
    // Seen from one view the wall is a quadrangle: a row or column has no gap in it.
    for (int y = 0; y < 90; ++y) {
      int first = 120, last = -1, count = 0;
      for (int x = 0; x < 120; ++x) {
        if (!(nearest[static_cast<size_t>(y * 120 + x)] > 0)) continue;
        first = std::min(first, x), last = x, ++count;
      }
      covered += count;
      const int expected = count > 0 ? last - first + 1 : 0;
      EXPECT_EQ(count, expected) << "camera " << i << ", row " << y;
    }
  }
  EXPECT_GT(covered, 40 * 120 * 90 / 4);
}

TEST(CoarseRaster, DoesNotDependOnTheNumberOfThreads) {
  const auto scenes = ParityScenes();
  const PinholeCamera novel(256, 256, 250, 250, 128, 128);
  Random random(6);
  for (const NamedScene& scene : scenes) {
    const Placed placed(scene.set, novel, RandomPose(random, 0.5));
    EXPECT_EQ(Raster(placed.placed, novel, 1), Raster(placed.placed, novel, 4)) << scene.name;
  }
}

TEST(CoarseRaster, WhatIsLeftOutBeforeDrawingWouldNotHaveShown) {
  // Each tile drawn alone by a camera that does not see it must leave the image empty. Cameras
  // among the surfaces, looking anywhere; the tile test is switched off by drawing tiles whose
  // bounds are those of everything.
  const auto scenes = ParityScenes();
  const PinholeCamera novel(64, 48, 50, 50, 32, 24);
  Random random(7);
  int left_out = 0, drawn = 0;
  for (const NamedScene& scene : scenes) {
    for (int i = 0; i < 25; ++i) {
      Placed placed(scene.set, novel, RandomPose(random, 12));
      for (size_t k = 0; k < placed.meshes.size(); ++k) {
        for (AdaptiveMesh::Tile& tile : placed.meshes[k].tiles) {
          const bool seen = MayBeSeen(tile, placed.placed[k].placement, 64, {0, 48});
          (seen ? drawn : left_out) += 1;
          if (seen) tile.triangle_count = tile.cell_count = 0;
          constexpr AdaptiveMesh::Range kAnything{-1e6f, 1e6f};
          tile.slope_x = tile.slope_y = tile.x = tile.y = kAnything;
          tile.inverse_depth = {0, 1e6f};
        }
      }
      for (const float w : Raster(placed.placed, novel, 1)) ASSERT_EQ(w, 0) << scene.name;
    }
  }
  EXPECT_GT(left_out, 100);
  EXPECT_GT(drawn, 100);
}

TEST(CoarseRaster, ACornerInThePlaneOfTheEyeIsCutOff) {
  // Views of one point look along each other's image planes. Here z = 0.01 x + 1e-40: the first
  // corner lies infinitely far to the left, and the triangle covers what is right of it.
  AdaptiveMesh mesh;
  mesh.columns = mesh.rows = 64;
  mesh.vertices = {{0, 10, 1}, {3200, 10, 1}, {3200, 1500, 1}};
  mesh.indices = {0, 1, 2};
  AdaptiveMesh::Tile tile;
  tile.triangle_count = 1;
  constexpr AdaptiveMesh::Range kAnything{-1e6f, 1e6f};
  tile.slope_x = tile.slope_y = tile.x = tile.y = kAnything;
  tile.inverse_depth = {0, 1e6f};
  mesh.tiles = {tile};
  GridPlacement placement;
  placement.from_grid << 1, 0, -1600, 0, 1, 0, 0.01, 0, 1e-40;
  const PinholeCamera novel(64, 48, 50, 50, 32, 24);
  const std::vector<float> nearest = Raster({{&mesh, placement}}, novel, 1);
  // At u the surface has x = 1600 / (1 - 0.01 u), and inverse depth 1 / (0.01 x).
  for (const int u : {5, 25, 45}) {
    const double expected = (1 - 0.01 * (u + 0.5)) / 16;
    EXPECT_NEAR(nearest[static_cast<size_t>(30 * 64 + u)], expected, 1e-3) << u;
  }
  EXPECT_EQ(nearest[static_cast<size_t>(30 * 64 + 60)], 0);
}

// Where edges of triangles round the other way another one may show; what both show is the same
// surface.
TEST(CoarseRaster, DrawsAlikeWithEveryInstructionSet) {
  constexpr float kSameDepth = 1e-5f;     // relative; single precision, some sums deep
  constexpr double kLargestShare = 5e-4;  // as between shaders and this rasteriser, below
  const auto scenes = ParityScenes();
  const PinholeCamera novel(200, 150, 180, 180, 100, 75);
  Random random(9);
  for (const NamedScene& scene : scenes) {
    const Placed placed(scene.set, novel, RandomPose(random, 0.5));
    const std::vector<float> best = Raster(placed.placed, novel, 1);
    WithEachInstructionSet([&](auto) {
      const std::vector<float> other = Raster(placed.placed, novel, 1);
      ASSERT_EQ(other.size(), best.size());
      int apart = 0;
      for (size_t i = 0; i < best.size(); ++i) {
        apart += std::abs(other[i] - best[i]) > kSameDepth * best[i];
      }
      EXPECT_LE(apart, kLargestShare * static_cast<double>(best.size())) << scene.name;
    });
  }
}

}  // namespace
}  // namespace dtr::testing
