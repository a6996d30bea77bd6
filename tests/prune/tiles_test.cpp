// Tiles that others cover, on scenes where it is known which do.
#include "dtr/prune/tiles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "datasets/exact/analytic_scene.h"
#include "dtr/cpu/renderer.h"
#include "dtr/render/frame.h"
#include "dtr/render/scene.h"
#include "tests/support/on_threads.h"

namespace dtr::prune {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::Key;
using ::testing::Not;

/// Cameras side by side before a wall, 192x128: tiles of 32 pixels, and every view sees nearly all
/// that its neighbours see.
DtrSet Wall(int views) {
  DtrSet set;
  set.scene_center = {0, 0, 5};
  set.frames.resize(1);
  for (int i = 0; i < views; ++i) {
    testing::Shot shot;
    shot.id = std::string("view") + static_cast<char>('a' + i);
    shot.camera = PinholeCamera(192, 128, 200, 200, 96, 64);
    shot.cam_from_world = testing::LookAt({0.1 * (i - 0.5 * (views - 1)), 0, 0}, {0, 0, 5});
    View view = testing::Photograph(testing::Plane({0, 0.2, -1}, -6), shot);
    view.reference_baseline = 0.2;
    view.near_z = 3, view.far_z = 10;
    set.frames[0].views.push_back(std::move(view));
  }
  return set;
}

View& ViewOf(DtrSet& set, int i) { return set.frames[0].views[static_cast<size_t>(i)]; }

TilesLeftOut Redundant(const DtrSet& set, const TileRule& rule) {
  return RedundantTiles(WhoCovers(set, {}), rule);
}

size_t CountOf(const TilesLeftOut& tiles) {
  size_t count = 0;
  for (const auto& [id, of_view] : tiles) {
    count += static_cast<size_t>(std::count(of_view.begin(), of_view.end(), 1));
  }
  return count;
}

DtrSet Without(DtrSet set, const TilesLeftOut& tiles) {
  for (View& view : set.frames[0].views) {
    if (tiles.contains(view.id)) view = WithoutTiles(view, tiles.at(view.id));
  }
  return set;
}

TEST(RedundantTiles, OfAnExactlyRedundantSetLoseNothingThatCanBeMeasured) {
  const DtrSet set = Wall(6);
  const TilesLeftOut tiles = Redundant(set, {2, 8});
  EXPECT_GE(CountOf(tiles), 6 * 24 / 3u) << "a third of all at least";
  const DtrSet pruned = Without(set, tiles);
  // The 8-bit photos round by half a level, and every view samples another place of them.
  constexpr double kMeanLevels = 0.35;  // 0.26 was seen
  for (const Eigen::Vector3d& from : {Eigen::Vector3d(0.05, 0.1, 0), {-0.22, 0, 0.3}, {0, 0, 0}}) {
    const Pose novel = testing::LookAt(from, {0, 0, 5});
    const PinholeCamera camera(96, 64, 110, 110, 48, 32);
    const RenderResult before = cpu::Render(MakeRenderScene(set), camera, novel, {});
    const RenderResult after = cpu::Render(MakeRenderScene(pruned), camera, novel, {});
    EXPECT_EQ(before.coverage, after.coverage);
    double sum = 0;
    for (size_t k = 0; k < before.image.data().size(); ++k) {
      sum += std::abs(before.image.data()[k] - after.image.data()[k]);
    }
    EXPECT_LE(sum / static_cast<double>(before.image.data().size()), kMeanLevels) << from;
  }
}

TEST(RedundantTiles, StayWhereNoOtherViewHoldsTheSurfaceOrShowsTheColour) {
  DtrSet set = Wall(5);
  ASSERT_THAT(Redundant(set, {2, 8}), Contains(Key("viewc")));
  // In the middle view, tile 8 (column 2, row 1) has a surface that others see through, tile 9 is
  // painted over. Each alone would be redundant.
  View& middle = ViewOf(set, 2);
  for (int y = 32; y < 64; ++y) {
    for (int x = 64; x < 96; ++x) middle.depth(x, y) = 4;
    for (int x = 96; x < 128; ++x) {
      for (int c = 0; c < 3; ++c) middle.image(x, y, c) = x % 2 == 0 ? 255 : 0;
    }
  }
  const TilesLeftOut tiles = Redundant(set, {2, 8});
  ASSERT_THAT(tiles, Contains(Key("viewc")));
  EXPECT_EQ(tiles.at("viewc")[8], 0);
  EXPECT_EQ(tiles.at("viewc")[9], 0);
  // Colour is a matter of the rule, surface is not.
  const TilesLeftOut any_colour = Redundant(set, {2, 255});
  EXPECT_EQ(any_colour.at("viewc")[8], 0);
  EXPECT_GE(CountOf(any_colour), CountOf(tiles));
}

TEST(RedundantTiles, StayWhereOthersAreCoarser) {
  // One camera close by, the rest three times as far away: they cannot show what it shows.
  DtrSet set = Wall(5);
  const TilesLeftOut equals = Redundant(set, {2, 8});
  ASSERT_THAT(equals, Contains(Key("viewc")));
  testing::Shot close;
  close.id = "viewc";
  close.camera = ViewOf(set, 2).camera;
  close.cam_from_world = testing::LookAt({0, 0, 3.5}, {0, 0, 5});
  View& middle = ViewOf(set, 2);
  middle = testing::Photograph(testing::Plane({0, 0.2, -1}, -6), close);
  middle.reference_baseline = 0.2;
  EXPECT_THAT(Redundant(set, {2, 8}), Not(Contains(Key("viewc"))));
}

TEST(RedundantTiles, AreCoveredByTilesThatStay) {
  const DtrSet set = Wall(7);
  const CoverMap map = WhoCovers(set, {});
  for (const int coverers : {1, 2, 3}) {
    const TilesLeftOut tiles = RedundantTiles(map, {coverers, 8});
    ASSERT_THAT(tiles, Not(IsEmpty()));
    const auto is_left_out = [&](const std::string& id, int tile) {
      return tiles.contains(id) && tiles.at(id)[static_cast<size_t>(tile)] != 0;
    };
    size_t places = 0, covered = 0;
    for (const CoveredView& view : map.views) {
      for (const CoveredPlace& place : view.places) {
        if (!is_left_out(view.id, place.tile)) continue;
        ++places;
        int stay = 0;
        for (int k = 0; k < place.count; ++k) {
          const Coverer& by = place.coverers[static_cast<size_t>(k)];
          stay += !is_left_out(map.views[static_cast<size_t>(by.view)].id, by.tile);
        }
        covered += stay >= coverers;
      }
    }
    EXPECT_GE(static_cast<double>(covered), 0.95 * static_cast<double>(places)) << coverers;
  }
}

TEST(RedundantTiles, DoNotDependOnTheOrderOfTheViewsNorOnThreads) {
  DtrSet set = Wall(5);
  const TilesLeftOut tiles = Redundant(set, {2, 8});
  std::reverse(set.frames[0].views.begin(), set.frames[0].views.end());
  EXPECT_EQ(RedundantTiles(OnThreads(1, [&] { return WhoCovers(set, {}); }), {2, 8}), tiles);
  EXPECT_THAT(RedundantTiles(OnThreads(1,
                                       [&] {
                                         return WhoCovers(set, {"viewb", "viewd"});
                                       }),
                             {2, 8}),
              Not(Contains(Key("viewb"))));
}

TEST(WithoutTiles, MasksThemTakesTheirDepthAndLeavesTheRestAlone) {
  DtrSet set = Wall(1);
  const View& view = ViewOf(set, 0);
  const TileGrid grid = TileGridOf(view);
  ASSERT_EQ(grid.size_px(), 32);
  ASSERT_EQ(grid.columns, 6);
  ASSERT_EQ(grid.rows, 4);
  std::vector<std::uint8_t> tiles(24);
  tiles[7] = 1;  // column 1, row 1
  const View rest = WithoutTiles(view, tiles);
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 192; ++x) {
      const bool left_out = x / 32 == 1 && y / 32 == 1;
      EXPECT_EQ(rest.mask(x, y), left_out ? 0 : 255);
      EXPECT_EQ(rest.depth(x, y), left_out ? 0 : view.depth(x, y));
      for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(rest.image(x, y, c), left_out ? rest.image(32, 32, c) : view.image(x, y, c));
      }
    }
  }
}

}  // namespace
}  // namespace dtr::prune
