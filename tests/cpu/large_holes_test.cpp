// SPEC 7.3 and 7.4 in whole images: large holes, and photos of different exposure.
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/cpu/renderer.h"
#include "dtr/render/colour.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/guessed_colours.h"
#include "tests/cpu/render_testing.h"

namespace dtr::cpu {
namespace {

using namespace dtr::testing;

constexpr int kWidth = 192, kHeight = 144;
constexpr double kMaxKnownZ = 6;  // nearer ground has no depth

Shot Wide(const std::string& id, const Eigen::Vector3d& center) {
  Shot shot = ShotFrom(id, center, {0, 0, 12});
  shot.camera = PinholeCamera(kWidth, kHeight, 200, 200, 0.5 * kWidth, 0.5 * kHeight);
  shot.texture_period = 5;
  return shot;
}

/// A wall at z = 12 and ground at y = 1.2, which has no depth near the cameras, as lawns have none.
Surface WallAndGround() { return Union(Plane({0, 0, 1}, 12), Plane({0, 1, 0}, 1.2)); }

DtrSet GroundWithoutDepth(const std::vector<double>& exposures) {
  std::vector<View> views;
  for (size_t i = 0; i < exposures.size(); ++i) {
    View view = Photograph(WallAndGround(),
                           Wide("v" + std::to_string(i), {static_cast<double>(i) - 1.5, 0, 0}));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (view.depth(x, y) < kMaxKnownZ) view.depth(x, y) = 0;
        for (int c = 0; c < 3; ++c) {
          const double linear = LinearFromSrgb8()[view.image(x, y, c)];
          view.image(x, y, c) = Srgb8FromLinear(0.6 * exposures[i] * linear);
        }
      }
    }
    views.push_back(std::move(view));
  }
  return SetOf(std::move(views));
}

RenderResult Filled(const DtrSet& set, const Shot& novel, int threads) {
  RenderOptions options;
  options.fill_holes = true;
  options.threads = threads;
  return Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
}

TEST(LargeHoles, GroundAtTheFeetContinuesWithoutCellsShowing) {
  const DtrSet set = GroundWithoutDepth({1, 1, 1, 1});
  const Shot novel = Wide("n", {0.1, 0.05, 0.2});
  View truth = Photograph(WallAndGround(), novel);
  for (std::uint8_t& level : truth.image.data()) {
    level = Srgb8FromLinear(0.6 * LinearFromSrgb8()[level]);
  }
  const RenderResult filled = Filled(set, novel, 1);
  ExpectSameBytes(filled, Filled(set, novel, 3));
  double sum = 0, at_borders = 0, inside = 0;
  int count = 0, borders = 0, insides = 0;
  const auto error = [&](int x, int y) {
    return static_cast<double>(filled.image(x, y, 0)) - truth.image(x, y, 0);
  };
  for (int y = kHeight / 2 + 1; y < kHeight; ++y) {
    for (int x = 1; x < kWidth; ++x) {
      if (filled.coverage(x, y) != 0 || filled.coverage(x - 1, y) != 0) continue;
      sum += PixelDifference(filled.image, truth.image, x, y);
      ++count;
      const double step = std::abs(error(x, y) - error(x - 1, y));
      if (x % 8 == 0) {
        at_borders += step, ++borders;
      } else {
        inside += step, ++insides;
      }
    }
  }
  EXPECT_GT(count, 4000);
  std::printf("levels %.2f, steps at borders of cells %.3f, inside %.3f\n", sum / count,
              at_borders / borders, inside / insides);
  EXPECT_LE(sum / count, 6);
  EXPECT_LE(at_borders / borders, 1.3 * inside / insides + 0.2);
}

TEST(HoleFiller, GivesTheBytesOfAPictureFilledAloneWhateverItKeeps) {
  DtrSet set = GroundWithoutDepth({1, 1.2, 1, 0.8});
  const Shot novel = Wide("n", {0.1, 0.05, 0.2});
  const RenderOptions options;
  HoleFiller filler;
  const auto expect_same = [&] {
    const RenderScene scene = MakeRenderScene(set);
    RenderResult alone = Render(scene, novel.camera, novel.cam_from_world, options);
    RenderResult kept = alone;
    FillHolesFromViews(scene, novel.camera, novel.cam_from_world, options, alone);
    filler.Fill(scene, novel.camera, novel.cam_from_world, options, kept);
    ExpectSameBytes(kept, alone);
  };
  expect_same();
  expect_same();
  const ImageRgb8 old = set.frames[0].views[1].image;
  std::vector<std::uint8_t> darker = old.data();
  for (std::uint8_t& level : darker) level = static_cast<std::uint8_t>(level / 2);
  ImageRgb8 other(old.width(), old.height(), 3);
  other.data() = darker;
  std::swap(set.frames[0].views[1].image, other);  // what was there stays allocated
  expect_same();
}

TEST(LargeHoles, WhatIsFilledIsExposedAsWhatWasSeen) {
  // The view nearest to the novel one is exposed as the others are on average.
  const DtrSet set = GroundWithoutDepth({0.7, 1.3, 0.8, 1.4});
  const Shot novel = Wide("n", {0.1, 0.05, 0.2});
  const View truth = Photograph(WallAndGround(), novel);
  const RenderResult filled = Filled(set, novel, 1);
  double shown[2] = {}, true_light[2] = {};  // seen ground, filled ground
  for (int y = kHeight / 2 + 12; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (truth.depth(x, y) > 11) continue;
      const int hole = filled.coverage(x, y) == 0 ? 1 : 0;
      shown[hole] += LinearFromSrgb8()[filled.image(x, y, 1)];
      true_light[hole] += LinearFromSrgb8()[truth.image(x, y, 1)];
    }
  }
  const double seen = shown[0] / true_light[0], guessed = shown[1] / true_light[1];
  std::printf("exposure of the seen %.3f, of the filled %.3f\n", seen, guessed);
  EXPECT_NEAR(guessed / seen, 1, 0.06);
}

TEST(Exposed, KeepsBlackAndWhiteAndScalesTheDark) {
  for (const double exposure : {0.5, 1.0, 2.0}) {
    EXPECT_EQ(Exposed(0, exposure), 0);
    EXPECT_NEAR(Exposed(1, exposure), 1, 1e-15);
    EXPECT_NEAR(Exposed(0.1, exposure), 0.1 * exposure, 1e-3 * exposure);
    double before = -1;
    for (double v = 0; v <= 1; v += 1.0 / 64) {
      EXPECT_GT(Exposed(v, exposure), before);
      before = Exposed(v, exposure);
      EXPECT_NEAR(Exposed(before, 1 / exposure), v, 1e-12);
    }
  }
}

}  // namespace
}  // namespace dtr::cpu
