#include "dtr/exposure/estimate_gains.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dtr/base/random.h"
#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"
#include "tests/support/on_threads.h"

namespace dtr {
namespace {

constexpr int kWidth = 64, kHeight = 48;

// Cameras side by side before a wall at z = 2, the colours of which repeat nowhere; exposed as
// said.
std::vector<View> Wall(const std::vector<Eigen::Vector3d>& exposures) {
  Random random(3);
  Grid<double> wall(400, kHeight, 3);
  for (double& light : wall.data()) light = 0.05 + 0.9 * random.Uniform();
  std::vector<View> views;
  for (size_t k = 0; k < exposures.size(); ++k) {
    View view;
    view.camera = PinholeCamera(kWidth, kHeight, 40, 40, kWidth / 2.0, kHeight / 2.0);
    const int shift = 6 * static_cast<int>(k);  // px: 40 x / 2
    view.cam_from_world.translation.x() = -shift * 2 / 40.0;
    view.image = ImageRgb8(kWidth, kHeight, 3);
    view.depth = DepthImage(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        view.depth(x, y) = 2;
        for (int c = 0; c < 3; ++c) {
          view.image(x, y, c) = Srgb8FromLinear(Exposed(wall(x + shift, y, c), exposures[k][c]));
        }
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

std::vector<Eigen::Vector3d> GainsOf(const std::vector<View>& views, int threads = 2) {
  std::vector<SmallView> small;
  std::vector<std::vector<int>> partners(views.size());
  for (const View& view : views) small.push_back(ShrinkForGains(view));
  for (int i = 0; i + 1 < static_cast<int>(views.size()); ++i) {
    partners[static_cast<size_t>(i)].push_back(i + 1);
    partners[static_cast<size_t>(i) + 1].push_back(i);
  }
  return OnThreads(threads, [&] { return EstimateGains(small, partners); });
}

TEST(Exposed, KeepsBlackAndWhiteAndMultiplies) {
  EXPECT_EQ(Exposed(0, 1.7), 0);
  EXPECT_DOUBLE_EQ(Exposed(1, 1.7), 1);
  EXPECT_NEAR(Exposed(0.01, 1.7), 0.017, 1e-6);
  EXPECT_NEAR(Exposed(Exposed(0.4, 1.7), 0.8), Exposed(0.4, 1.7 * 0.8), 1e-12);
  EXPECT_NEAR(Exposed(Exposed(0.6, 3), 1 / 3.0), 0.6, 1e-12);
  EXPECT_NEAR(ExposureBetween(0.3, Exposed(0.3, 1.4)), 1.4, 1e-12);
}

TEST(EstimateGains, UndoWhatThePhotosWereExposedBy) {
  const std::vector<Eigen::Vector3d> exposures{
      {1.3, 1.2, 1.1}, {0.8, 0.9, 1.0}, {1.0, 1.0, 1.0}, {0.7, 0.75, 1.2}};
  const auto gains = GainsOf(Wall(exposures));
  ASSERT_EQ(gains.size(), exposures.size());
  for (size_t k = 1; k < gains.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      const double true_ratio = exposures[0][c] / exposures[k][c];
      // The damping takes some 1 % of a logarithm.
      EXPECT_NEAR(std::log(gains[k][c] / gains[0][c]), std::log(true_ratio), 0.03) << k << c;
    }
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& gain : gains) sum += gain.array().log().matrix();
  EXPECT_LT(sum.norm(), 1e-6);
}

TEST(EstimateGains, WhatIsTwoPercentApartStaysAsItIs) {
  const auto gains = GainsOf(Wall({{1.01, 1, 0.99}, {1, 1.01, 1}, {0.99, 1, 1}}));
  for (const auto& gain : gains) EXPECT_EQ(gain, Eigen::Vector3d::Ones());
}

// No exposure makes a patch that is half in the dark as bright as one that is all bright.
TEST(EstimateGains, PatchesThatNoExposureExplainsChangeNothing) {
  std::vector<View> views = Wall({{1.4, 1.4, 1.4}, {0.8, 0.8, 0.8}});
  const auto without = GainsOf(views);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 16; x < 24; ++x) {
      for (int c = 0; c < 3; ++c) {
        views[0].image(x, y, c) = x % 8 < 4 ? 40 : 243;
        views[1].image(x - 6, y, c) = 243;
      }
    }
  }
  const auto with = GainsOf(views);
  for (size_t k = 0; k < with.size(); ++k) EXPECT_LT((with[k] - without[k]).norm(), 0.02);
}

TEST(EstimateGains, HighlightsOfHalfTheWallChangeNothing) {
  std::vector<View> views = Wall({{1.4, 1.4, 1.4}, {0.8, 0.8, 0.8}});
  const auto without = GainsOf(views);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 3; ++x) {
      for (int c = 0; c < 3; ++c) views[0].image(x, y, c) = 255;
    }
  }
  const auto with = GainsOf(views);
  for (size_t k = 0; k < with.size(); ++k) EXPECT_LT((with[k] - without[k]).norm(), 0.02);
}

// Of two photos of one exposure, a fifth and a quarter of the wall are brighter in the second, by
// anything up to 60 %: highlights, and other surfaces where depth is wrong.
TEST(EstimateGains, WhatIsBrighterFromOnePositionAloneIsNoExposure) {
  std::vector<View> views = Wall({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  Random random(5);
  const auto brighten = [&](View& view, int first, int end) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = first; x < end; ++x) {
        const double by = 1 + 0.6 * random.Uniform();
        for (int c = 0; c < 3; ++c) {
          std::uint8_t& value = view.image(x, y, c);
          value = Srgb8FromLinear(Exposed(LinearFromSrgb8()[value], by));
        }
      }
    }
  };
  brighten(views[1], 0, 28);
  brighten(views[2], 10, 38);
  for (View& view : views) {  // and what a sensor adds
    for (std::uint8_t& value : view.image.data()) {
      value = static_cast<std::uint8_t>(std::clamp(value + random.Normal() * 2, 0.0, 255.0));
    }
  }
  for (const auto& gain : GainsOf(views)) EXPECT_EQ(gain, Eigen::Vector3d::Ones());
}

TEST(EstimateGains, AViewWithoutAPartnerKeepsOne) {
  std::vector<View> views = Wall({{1.4, 1.4, 1.4}, {0.8, 0.8, 0.8}, {1.2, 1.2, 1.2}});
  views[2].depth = DepthImage(kWidth, kHeight);  // nothing measured
  const auto gains = GainsOf(views);
  EXPECT_LT((gains[2] - Eigen::Vector3d::Ones()).norm(), 1e-9);
  EXPECT_LT(gains[0].x(), 0.85);
}

TEST(EstimateGains, AreTheSameForAnyNumberOfThreads) {
  const std::vector<View> views = Wall({{1.3, 1.2, 1.1}, {0.8, 0.9, 1.0}, {1, 1, 1}});
  EXPECT_EQ(GainsOf(views, 1), GainsOf(views, 5));
}

TEST(EstimateGains, OfNothingAreNone) {
  EXPECT_TRUE(GainsOf({}).empty());
  const auto gains = GainsOf(Wall({{2, 2, 2}}));
  EXPECT_EQ(gains, std::vector<Eigen::Vector3d>{Eigen::Vector3d::Ones()});
}

}  // namespace
}  // namespace dtr
