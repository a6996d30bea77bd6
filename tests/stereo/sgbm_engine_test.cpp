#include "stereo/sgbm/sgbm_engine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "datasets/exact/stereo_quality.h"
#include "tests/support/on_threads.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector3d;
using testing::Facing;
using testing::Photograph;
using testing::Quality;
using testing::Shot;
using testing::Slanted;
using testing::SphereBeforeWall;
using testing::ViewsOf;

constexpr int kWidth = 240, kHeight = 180;
constexpr double kFocal = 200;
/// Baseline 0.4 at depth 4: 20 px of disparity, so 1 px is 5 % of depth.
constexpr double kBaseline = 0.4;
constexpr DepthRange kRange{2.5, 8};
/// Median error on clean synthetic images; SGBM's pull to whole pixels leaves about 0.1 px.
constexpr double kMedianPx = 0.2;
/// Share of the pixels both cameras see (all but a strip of 20 to 30 columns) that get depth.
constexpr double kMinKept = 0.75;

const PinholeCamera kCamera(kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth, 0.5 * kHeight);

std::vector<Shot> Shots(const testing::Surface& surface, const std::vector<Pose>& poses) {
  return testing::ShotsOf(surface, kCamera, poses);
}

DepthEstimate EstimateFirst(const std::vector<StereoView>& views, const DepthRange& range = kRange,
                            int threads = 2) {
  return OnThreads(threads, [&] { return testing::EstimateFirstBy("sgbm", views, range); });
}

Quality QualityOf(const DepthEstimate& estimate, const DepthImage& truth) {
  return testing::QualityAt(kFocal * kBaseline, estimate, truth);
}

TEST(SgbmEngine, FindsASlantedPlaneFromTwoViews) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
  EXPECT_GT(q.kept, kMinKept);
  EXPECT_LT(q.median_px, kMedianPx);
  EXPECT_LT(q.bad_share, 0.02);
}

TEST(SgbmEngine, FindsASphereBeforeAWallFromFourNeighbours) {
  const auto shots = Shots(
      SphereBeforeWall(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}), Facing({-kBaseline, 0, 0}),
                           Facing({0, kBaseline, 0}), Facing({0, -kBaseline, 0})});
  const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
  EXPECT_GT(q.kept, 0.9);  // what one side hides the other shows
  EXPECT_LT(q.median_px, kMedianPx);
  EXPECT_LT(q.bad_share, 0.03);
}

TEST(SgbmEngine, HalfAPixelInThePrincipalPointWouldShow) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  std::vector<StereoView> views = ViewsOf(shots);
  const double right = QualityOf(EstimateFirst(views), shots[0].truth).mean_px;
  views[1].camera =
      PinholeCamera(kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth + 0.5, 0.5 * kHeight);
  const double slipped = QualityOf(EstimateFirst(views), shots[0].truth).mean_px;
  EXPECT_LT(std::abs(right), 0.08);  // 0.02 to 0.05 px remain of the pull to whole pixels
  EXPECT_NEAR(slipped - right, 0.5, 0.1);
}

TEST(SgbmEngine, VerticalAndRolledAndLeftHandPairsGiveTheSameDepth) {
  const struct {
    const char* name;
    Pose neighbour;
  } cases[] = {{"below", Facing({0, kBaseline, 0})},
               {"above", Facing({0, -kBaseline, 0})},
               {"left", Facing({-kBaseline, 0, 0})},
               {"rolled by 90", Facing({kBaseline, 0, 0}, 90)},
               {"rolled by -37, diagonal", Facing({0.28, 0.28, 0}, -37)}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), c.neighbour});
    const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
    EXPECT_GT(q.kept, 0.55);  // a rolled or vertical partner sees less of the image
    EXPECT_LT(q.median_px, kMedianPx);
    EXPECT_LT(q.bad_share, 0.03);
  }
}

TEST(SgbmEngine, TheNumberOfThreadsChangesNoBit) {
  const auto shots = Shots(SphereBeforeWall(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                                                Facing({0, kBaseline, 0})});
  const auto views = ViewsOf(shots);
  const int before = cv::getNumThreads();
  cv::setNumThreads(1);
  const DepthEstimate one = EstimateFirst(views, kRange, 1);
  cv::setNumThreads(4);
  const DepthEstimate two = EstimateFirst(views, kRange, 2);
  cv::setNumThreads(before);
  EXPECT_EQ(one.depth, two.depth);
  EXPECT_EQ(one.inverse_depth_sigma, two.inverse_depth_sigma);
}

TEST(SgbmEngine, SigmaDescribesTheError) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                                       Facing({0, kBaseline, 0}), Facing({-kBaseline, 0, 0})});
  const DepthEstimate estimate = EstimateFirst(ViewsOf(shots));
  int within = 0, all = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float z = estimate.depth(x, y), sigma = estimate.inverse_depth_sigma(x, y);
      ASSERT_EQ(DepthImage::IsHole(z), sigma == 0);
      if (DepthImage::IsHole(z)) continue;
      ++all;
      within += std::abs(1 / z - 1 / shots[0].truth(x, y)) <= sigma;
    }
  }
  // 68 % for a perfect model; clean images do better than the noise assumed for photos.
  EXPECT_GT(within, 0.6 * all);
}

TEST(SgbmEngine, WithoutABaselineThePairIsRejected) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({0, 0, 0})});
  EXPECT_THROW(EstimateFirst(ViewsOf(shots)), NoUsablePair);
}

TEST(SgbmEngine, ForwardMotionIsRejectedAndTheOtherNeighboursAreUsed) {
  const auto shots =
      Shots(Slanted(), {Facing({0, 0, 0}), Facing({0.05, 0, 0.5}), Facing({kBaseline, 0, 0})});
  auto views = ViewsOf(shots);
  const DepthEstimate with_three = EstimateFirst(views);
  EXPECT_LT(QualityOf(with_three, shots[0].truth).median_px, kMedianPx);
  views.resize(2);
  try {
    EstimateFirst(views);
    FAIL() << "forward motion was accepted";
  } catch (const NoUsablePair& error) {
    EXPECT_NE(std::string(error.what()).find("with view 1"), std::string::npos) << error.what();
  }
}

TEST(SgbmEngine, MaskedPixelsAreHolesAndTheirContentHasNoInfluence) {
  auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  std::vector<Mask> masks(2, Mask(kWidth, kHeight, 1, 255));
  for (int y = 60; y < 110; ++y) {
    for (int x = 90; x < 140; ++x) masks[0](x, y) = masks[1](x - 15, y) = 0;
  }
  const auto estimate = [&] {
    auto views = ViewsOf(shots);
    for (size_t i = 0; i < 2; ++i) views[i].mask = &masks[i];
    return EstimateFirst(views);
  };
  const DepthEstimate before = estimate();
  for (int y = 60; y < 110; ++y) {
    for (int x = 90; x < 140; ++x) {
      EXPECT_TRUE(DepthImage::IsHole(before.depth(x, y)));
      for (int c = 0; c < 3; ++c) {
        shots[0].image(x, y, c) = static_cast<std::uint8_t>(HashOf(x, y));
        shots[1].image(x - 15, y, c) = static_cast<std::uint8_t>(HashOf(y, x));
      }
    }
  }
  const DepthEstimate after = estimate();
  EXPECT_EQ(before.depth, after.depth);
  EXPECT_LT(QualityOf(after, shots[0].truth).bad_share, 0.05);
}

TEST(SgbmEngine, ATexturelessWallIsMostlyHoles) {
  auto shots = Shots(testing::Plane({0, 0, 1}, 4),
                     {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}), Facing({-kBaseline, 0, 0})});
  std::uint64_t n = 0;
  for (Shot& shot : shots) {
    for (auto& value : shot.image.data())
      value = static_cast<std::uint8_t>(127 + HashBits(n++) % 3);
  }
  EXPECT_LT(QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth).kept, 0.3);
}

TEST(SgbmEngine, ScaleAndOffsetOfTheWorldDoNotMatter) {
  const auto shots = Shots(SphereBeforeWall(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}, 10),
                                                Facing({0, kBaseline, 0})});
  const DepthEstimate base = EstimateFirst(ViewsOf(shots));
  const auto moved = [&](double scale, const Vector3d& offset) {
    auto views = ViewsOf(shots);
    for (StereoView& view : views) {
      const Vector3d centre = scale * view.cam_from_world.TargetOriginInSource() + offset;
      view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
    }
    return EstimateFirst(views, {kRange.near_z * scale, kRange.far_z * scale});
  };
  for (const auto& [scale, offset] : {std::pair(1e-3, Vector3d(0, 0, 0)),
                                      {1e3, Vector3d(0, 0, 0)},
                                      {1.0, Vector3d(5e5, 4.5e6, 100)}}) {
    SCOPED_TRACE(scale);
    const DepthEstimate other = moved(scale, offset);
    int differing = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        // 1e-9 of baseline at 4.5e6 may turn a rounding of a grey value; nothing more.
        differing += std::abs(other.depth(x, y) / scale - base.depth(x, y)) > 0.01f;
      }
    }
    EXPECT_LT(differing, 0.002 * kWidth * kHeight);
  }
}

TEST(SgbmEngine, RejectsAnEmptyRangeAndAWrongSize) {
  auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  EXPECT_THROW(EstimateFirst(ViewsOf(shots), {4, 4}), Error);
  EXPECT_THROW(EstimateFirst(ViewsOf(shots), {0, 4}), Error);
  shots[1].image = ImageRgb8(kWidth, kHeight + 1, 3);
  EXPECT_THROW(EstimateFirst(ViewsOf(shots)), Error);
}

TEST(MakeEngine, NamesTheEnginesThereAre) {
  EXPECT_EQ(MakeEngine("sgbm")->name(), "sgbm");
  for (const char* name : {"colmap", "", "SGBM"}) {
    try {
      MakeEngine(name);
      FAIL() << name;
    } catch (const UsageError& error) {
      EXPECT_NE(std::string(error.what()).find("sgbm"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace dtr::stereo
