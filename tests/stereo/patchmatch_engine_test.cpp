#include "stereo/patchmatch/patchmatch_engine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "datasets/exact/stereo_quality.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/random.h"
#include "dtr/eval/sigma_scores.h"
#include "tests/support/instruction_sets.h"
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

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 140;
/// Baseline 0.4 at depth 4: 14 px of disparity, so 1 px is 7 % of depth.
constexpr double kBaseline = 0.4;
constexpr DepthRange kRange{2.5, 8};
/// Median error on clean synthetic images; measured 0.02 px, 8-bit images leave that much.
constexpr double kMedianPx = 0.05;

const PinholeCamera kCamera(kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth, 0.5 * kHeight);

std::vector<Shot> Shots(const testing::Surface& surface, const std::vector<Pose>& poses) {
  return testing::ShotsOf(surface, kCamera, poses);
}

DepthEstimate EstimateFirst(const std::vector<StereoView>& views, const DepthRange& range = kRange,
                            int threads = 2) {
  return OnThreads(threads, [&] { return testing::EstimateFirstBy("patchmatch", views, range); });
}

Quality QualityOf(const DepthEstimate& estimate, const DepthImage& truth) {
  return testing::QualityAt(kFocal * kBaseline, estimate, truth);
}

TEST(PatchMatchEngine, FindsASlantedPlaneToAFractionOfAPixelFromTwoViews) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
  EXPECT_GT(q.kept, 0.8);  // a strip of 14 to 20 columns is seen by one camera only
  EXPECT_LT(q.median_px, kMedianPx);
  EXPECT_LT(q.bad_share, 0.01);
}

TEST(PatchMatchEngine, HalfAPixelInThePrincipalPointWouldShow) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  std::vector<StereoView> views = ViewsOf(shots);
  const double right = QualityOf(EstimateFirst(views), shots[0].truth).mean_px;
  views[1].camera =
      PinholeCamera(kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth + 0.5, 0.5 * kHeight);
  const double slipped = QualityOf(EstimateFirst(views), shots[0].truth).mean_px;
  EXPECT_LT(std::abs(right), 0.02);
  EXPECT_NEAR(slipped - right, 0.5, 0.05);
}

TEST(PatchMatchEngine, FindsASphereBeforeAWallFromFourNeighbours) {
  const auto shots = Shots(
      SphereBeforeWall(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}), Facing({-kBaseline, 0, 0}),
                           Facing({0, kBaseline, 0}), Facing({0, -kBaseline, 0})});
  const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
  EXPECT_GT(q.kept, 0.9);  // what one side hides the other shows
  EXPECT_LT(q.median_px, kMedianPx);
  EXPECT_LT(q.bad_share, 0.03);
}

// Past the edge of a near wall the far one is seen by one neighbour of five. First guesses by the
// mean of two views find it here, too: what one view's say is worth shows on fountain (DEPTH.md).
TEST(PatchMatchEngine, FindsWhatOneNeighbourAloneSees) {
  constexpr double kNear = 3, kFar = 7, kEdge = -0.3, kLeft = -0.8;
  const auto near_wall = [=](const Vector3d& o, const Vector3d& d) -> std::optional<double> {
    const double t = (kNear - o.z()) / d.z();
    return t > 0 && o.x() + t * d.x() < kEdge ? std::optional(t) : std::nullopt;
  };
  const testing::Surface walls = testing::Union({near_wall, testing::Plane({0, 0, 1}, kFar)});
  const auto shots = Shots(
      walls, {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}), Facing({kLeft, 0, 0}),
              Facing({kLeft - 0.1, 0.1, 0}), Facing({kLeft, -0.2, 0}), Facing({kLeft, 0.2, 0})});
  const auto views = ViewsOf(shots);
  const PlaneMap planes =
      MakeEngine("patchmatch")->Match(views, 0, std::vector{1, 2, 3, 4, 5}, {2.5, 8}, {});
  // Where the edge as seen from x lies on the far wall, and that in pixels of the first view.
  const auto behind = [&](double x) {
    const double far_x = x + (kEdge - x) * kFar / kNear;
    return static_cast<int>(0.5 * kWidth + kFocal * far_x / kFar);
  };
  constexpr int kWindow = 4;  // a window that reaches beyond the strip sees something else
  int found = 0, all = 0;
  for (int y = 20; y < kHeight - 20; ++y) {
    for (int x = behind(0) + kWindow; x < behind(kLeft) - kWindow; ++x) {
      const double w = planes.inverse_depth(x, y) / planes.unit_z;
      found += std::abs(w - 1 / kFar) * kFocal * kBaseline < 1;
      ++all;
    }
  }
  ASSERT_GT(all, 800);
  EXPECT_GT(found, all * 9 / 10);
}

TEST(PatchMatchEngine, AnyDirectionOfTheBaselineWillDo) {
  const struct {
    const char* name;
    Pose neighbour;
    double bad_share = 0.03;
  } cases[] = {{"below", Facing({0, kBaseline, 0})},
               {"left", Facing({-kBaseline, 0, 0})},
               {"rolled by 90", Facing({kBaseline, 0, 0}, 90)},
               {"rolled by -37, diagonal", Facing({0.28, 0.28, 0}, -37)},
               // The epipole lies at the right border; the depth is uncertain there.
               {"ahead and to the side", Facing({0.3, 0.0, 0.5}), 0.06}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), c.neighbour});
    const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
    EXPECT_GT(q.kept, 0.5);  // a rolled or vertical partner sees less of the image
    EXPECT_LT(q.median_px, 2 * kMedianPx);
    EXPECT_LT(q.bad_share, c.bad_share);
  }
}

TEST(PatchMatchEngine, TheNumberOfThreadsChangesNoBit) {
  const auto shots = Shots(SphereBeforeWall(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                                                Facing({0, kBaseline, 0})});
  const auto views = ViewsOf(shots);
  const DepthEstimate one = EstimateFirst(views, kRange, 1);
  for (const int threads : {2, 3}) {
    const DepthEstimate other = EstimateFirst(views, kRange, threads);
    EXPECT_EQ(one.depth, other.depth);
    EXPECT_EQ(one.inverse_depth_sigma, other.inverse_depth_sigma);
  }
}

/// True for instruction sets that round a product and a sum once (FMA), as the kernels then do.
/// Of x86, whose better targets have lower numbers.
bool Fuses(std::int64_t target) { return target <= HWY_AVX2; }

/// Runs `estimate` with each instruction set of this machine. Those that round alike must give the
/// same bytes however many pixels fit into a register; the others send the random search other
/// ways, and what it finds must be as good.
template <typename Estimate>
void ExpectTheSameFromAllInstructionSets(const DepthImage& truth, Estimate estimate) {
  std::optional<DepthEstimate> first[2];
  dtr::testing::WithEachInstructionSet([&](std::int64_t target) {
    const DepthEstimate found = estimate();
    std::optional<DepthEstimate>& same = first[Fuses(target)];
    if (!same) same = found;
    EXPECT_EQ(found.depth, same->depth);
    EXPECT_EQ(found.inverse_depth_sigma, same->inverse_depth_sigma);
  });
  if (!first[0] || !first[1]) return;
  const Quality plain = QualityOf(*first[0], truth), fused = QualityOf(*first[1], truth);
  EXPECT_NEAR(plain.kept, fused.kept, 0.01);
  EXPECT_NEAR(plain.median_px, fused.median_px, 0.005);
  EXPECT_NEAR(plain.bad_share, fused.bad_share, 0.01);
}

TEST(PatchMatchEngine, InstructionSetsThatRoundAlikeFindTheSameBytes) {
  const auto shots = Shots(SphereBeforeWall(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                                                Facing({0, kBaseline, 0})});
  const auto views = ViewsOf(shots);
  ExpectTheSameFromAllInstructionSets(shots[0].truth, [&] { return EstimateFirst(views); });
}

/// The first view after all passes, with every other view as everyone's neighbour.
DepthEstimate AfterPasses(const std::vector<StereoView>& views, int threads = 2) {
  const ThreadLimit limit(threads);
  const auto engine = MakeEngine("patchmatch");
  const int count = static_cast<int>(views.size());
  const auto others = [&](int view) {
    std::vector<int> list;
    for (int i = 0; i < count; ++i) {
      if (i != view) list.push_back(i);
    }
    return list;
  };
  std::vector<PlaneMap> maps, next;
  std::vector<const PlaneMap*> known(views.size());
  for (int v = 0; v < count; ++v) {
    maps.push_back(engine->Match(views, v, others(v), kRange, {}));
  }
  for (int pass = 1; pass <= engine->Passes(); ++pass, maps = std::move(next)) {
    for (size_t v = 0; v < views.size(); ++v) known[v] = &maps[v];
    next.clear();
    for (int v = 0; v < count; ++v) {
      next.push_back(engine->Refine(views, v, others(v), kRange, known, pass, {}));
    }
  }
  for (size_t v = 0; v < views.size(); ++v) known[v] = &maps[v];
  return engine->Filter(views, 0, others(0), kRange, known, {});
}

/// The sphere from the first `count` of: the middle, right, left, below, above.
std::vector<Shot> SphereFrom(size_t count) {
  std::vector<Pose> poses = {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                             Facing({-kBaseline, 0, 0}), Facing({0, kBaseline, 0}),
                             Facing({0, -kBaseline, 0})};
  poses.resize(count);
  return Shots(SphereBeforeWall(), poses);
}

TEST(PatchMatchEngine, PassesFillWhatOneViewAloneGetsWrong) {
  const auto shots = SphereFrom(5);
  const auto views = ViewsOf(shots);
  const Quality alone = QualityOf(EstimateFirst(views), shots[0].truth);
  const Quality together = QualityOf(AfterPasses(views), shots[0].truth);
  EXPECT_GT(together.kept * (1 - together.bad_share), alone.kept * (1 - alone.bad_share));
  EXPECT_GT(together.kept, 0.97);
  EXPECT_LT(together.median_px, kMedianPx);
  EXPECT_LT(together.bad_share, 0.03);
}

TEST(PatchMatchEngine, TheNumberOfThreadsChangesNoBitOfThePasses) {
  const auto shots = SphereFrom(3);
  const auto views = ViewsOf(shots);
  const DepthEstimate one = AfterPasses(views, 1), three = AfterPasses(views, 3);
  EXPECT_EQ(one.depth, three.depth);
  EXPECT_EQ(one.inverse_depth_sigma, three.inverse_depth_sigma);
}

TEST(PatchMatchEngine, InstructionSetsThatRoundAlikeGiveTheSameBytesAfterThePasses) {
  const auto shots = SphereFrom(2);
  const auto views = ViewsOf(shots);
  ExpectTheSameFromAllInstructionSets(shots[0].truth, [&] { return AfterPasses(views); });
}

TEST(PatchMatchEngine, SigmaDescribesTheError) {
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
  EXPECT_GT(within, 0.5 * all);  // 68 % for a perfect model
  EXPECT_LT(within, 0.95 * all);
}

/// Of the pixels with a depth: how far 1/z is off, and what is said of it.
struct Errors {
  std::vector<double> errors, sigmas;
};

Errors ErrorsOf(const DepthEstimate& estimate, const DepthImage& truth) {
  Errors of;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      const float z = estimate.depth(x, y);
      if (DepthImage::IsHole(z)) continue;
      of.errors.push_back(std::abs(1 / z - 1 / truth(x, y)));
      of.sigmas.push_back(estimate.inverse_depth_sigma(x, y));
    }
  }
  return of;
}

eval::SigmaScores ScoreSigmas(const Errors& of) {
  eval::SigmaScorer scorer;
  for (size_t i = 0; i < of.errors.size(); ++i) scorer.Add(of.errors[i], of.sigmas[i], false);
  return scorer.Scores();
}

std::vector<Shot> NoisyShots(const std::vector<Pose>& poses, double noise_levels) {
  std::vector<Shot> shots = Shots(Slanted(), poses);
  Random random(1);
  for (Shot& shot : shots) {
    for (std::uint8_t& value : shot.image.data()) {
      const double noisy = std::round(value + noise_levels * random.Normal());
      value = static_cast<std::uint8_t>(std::clamp(noisy, 0.0, 255.0));
    }
  }
  return shots;
}

TEST(PatchMatchEngine, SigmaIsHonestWhateverTheNumberOfViews) {
  const std::vector<Pose> poses = {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                                   Facing({0, kBaseline, 0}), Facing({-kBaseline, 0, 0}),
                                   Facing({0, -kBaseline, 0})};
  for (const double noise_levels : {2.0, 6.0}) {
    const std::vector<Shot> shots = NoisyShots(poses, noise_levels);
    for (const int count : {2, 3, 5}) {
      std::vector<StereoView> views = ViewsOf(shots);
      views.erase(views.begin() + count, views.end());
      const eval::SigmaScores scores = ScoreSigmas(ErrorsOf(EstimateFirst(views), shots[0].truth));
      // 68 % for a perfect model. Textures as clear as these keep what doubt adds to sigma above
      // the error where there is little noise.
      EXPECT_GT(*scores.share_within_1_sigma, 0.6) << count << " views, noise " << noise_levels;
      EXPECT_LT(*scores.share_within_1_sigma, 0.92) << count << " views, noise " << noise_levels;
      EXPECT_GT(*scores.share_within_2_sigma, 0.9) << count << " views, noise " << noise_levels;
    }
  }
}

// Noise of the reference pulls views from opposite sides to opposite depths and views from one side
// to one: by least squares the sigmas of one neighbour, two from one side and two from opposite
// sides are as sqrt 2, sqrt 1.5 and sqrt 0.5, and so are the errors.
TEST(PatchMatchEngine, SigmaKnowsThatOppositeBaselinesCancelTheNoiseOfTheReference) {
  const auto medians = [](const std::vector<Pose>& poses) {
    const std::vector<Shot> shots = NoisyShots(poses, 6);
    Errors of = ErrorsOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
    return std::pair(UpperMedian(of.errors), UpperMedian(of.sigmas));
  };
  const Pose here = Facing({0, 0, 0}), right = Facing({kBaseline, 0, 0});
  const auto [one_error, one] = medians({here, right});
  const auto [same_error, same] = medians({here, right, Facing({kBaseline, 0.02, 0})});
  const auto [opposite_error, opposite] = medians({here, right, Facing({-kBaseline, 0, 0})});
  EXPECT_NEAR(same_error / one_error, std::sqrt(1.5 / 2), 0.12);
  EXPECT_NEAR(opposite_error / one_error, std::sqrt(0.5 / 2), 0.12);
  // The spread of the views' own minima and doubt keep sigma from falling as far.
  EXPECT_NEAR(same / one, same_error / one_error, 0.12);
  EXPECT_NEAR(opposite / one, opposite_error / one_error, 0.12);
  EXPECT_LT(opposite, 0.85 * same) << "with one number of views the two would be alike";
}

TEST(PatchMatchEngine, WhatOneViewAloneHoldsIsDoubted) {
  auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}),
                                 Facing({0, kBaseline, 0}), Facing({-kBaseline, 0, 0})});
  // Something moves while the photos are taken: the first neighbour shows the reference's square
  // 60...99 x 40...79 5 pixels beside where it should be, the others know nothing of it. The match
  // is exact and sharp, and wrong.
  const int moved = 5, disparity = 14;
  for (int y = 30; y < 90; ++y) {
    for (int x = 40; x < 120; ++x) {
      for (int c = 0; c < 3; ++c) {
        shots[1].image(x - disparity - moved, y, c) = shots[0].image(x, y, c);
      }
    }
  }
  for (size_t n = 2; n < shots.size(); ++n) {
    for (int y = 20; y < 100; ++y) {
      for (int x = 40; x < 120; ++x) {
        const auto grey = static_cast<std::uint8_t>(
            testing::Texture({0.05 * x, 0.05 * y, 10.0 * static_cast<double>(n)}, 0.35));
        for (int c = 0; c < 3; ++c) shots[n].image(x, y, c) = grey;
      }
    }
  }
  const DepthEstimate estimate = EstimateFirst(ViewsOf(shots));
  std::vector<float> right, wrong;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float z = estimate.depth(x, y);
      if (DepthImage::IsHole(z)) continue;
      const double px = kFocal * kBaseline * std::abs(1 / z - 1 / shots[0].truth(x, y));
      const bool inside = x >= 60 && x < 100 && y >= 40 && y < 80;
      const bool outside = x >= 20 && x < 140 && y >= 104;  // seen by all
      if (inside && px > 2) wrong.push_back(estimate.inverse_depth_sigma(x, y));
      if (outside && px < 1) right.push_back(estimate.inverse_depth_sigma(x, y));
    }
  }
  const auto median = [](std::vector<float>& v) {
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
  };
  ASSERT_GT(wrong.size(), 500u);
  ASSERT_GT(right.size(), 1000u);
  EXPECT_GT(median(wrong), median(right));  // 1.2 times; 0.6 by curvature and spread alone
}

TEST(PatchMatchEngine, WithoutABaselineThereIsNoDepth) {
  const auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({0, 0, 0})});
  EXPECT_THROW(EstimateFirst(ViewsOf(shots)), NoUsablePair);
}

/// Two photos, the same place of the scene masked in both.
struct MaskedPair {
  std::vector<testing::Shot> shots =
      Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  std::vector<Mask> masks{2, Mask(kWidth, kHeight, 1, 255)};

  MaskedPair() {
    Visit([this](int x, int y) { masks[0](x, y) = masks[1](x - 12, y) = 0; });
  }
  template <typename PerPixel>
  static void Visit(PerPixel per_pixel) {
    for (int y = 40; y < 70; ++y) {
      for (int x = 60; x < 90; ++x) per_pixel(x, y);
    }
  }
  void PaintUnderTheMasks() {
    Visit([this](int x, int y) {
      for (int c = 0; c < 3; ++c) {
        shots[0].image(x, y, c) = static_cast<std::uint8_t>(HashOf(x, y));
        shots[1].image(x - 12, y, c) = static_cast<std::uint8_t>(HashOf(y, x));
      }
    });
  }
  DepthEstimate Estimate() const {
    auto views = ViewsOf(shots);
    for (size_t i = 0; i < 2; ++i) views[i].mask = &masks[i];
    return EstimateFirst(views);
  }
};

TEST(PatchMatchEngine, MaskedPixelsAreHolesAndTheirContentHasNoInfluence) {
  MaskedPair pair;
  const DepthEstimate before = pair.Estimate();
  MaskedPair::Visit([&](int x, int y) { EXPECT_TRUE(DepthImage::IsHole(before.depth(x, y))); });
  pair.PaintUnderTheMasks();
  const DepthEstimate after = pair.Estimate();
  EXPECT_EQ(before.depth, after.depth);
  EXPECT_LT(QualityOf(after, pair.shots[0].truth).bad_share, 0.02);
}

TEST(PatchMatchEngine, ColoursUnderAMaskDoNotTurnLineArtIntoAPhoto) {
  MaskedPair pair;
  for (testing::Shot& shot : pair.shots) {
    for (std::uint8_t& level : shot.image.data()) level = level > 128 ? 255 : 0;
  }
  const DepthEstimate before = pair.Estimate();
  pair.PaintUnderTheMasks();
  EXPECT_EQ(before.depth, pair.Estimate().depth);
}

TEST(PatchMatchEngine, ATexturelessWallIsHoles) {
  auto shots = Shots(testing::Plane({0, 0, 1}, 4),
                     {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}), Facing({-kBaseline, 0, 0})});
  std::uint64_t n = 0;
  for (Shot& shot : shots) {
    for (auto& value : shot.image.data())
      value = static_cast<std::uint8_t>(127 + HashBits(n++) % 3);
  }
  EXPECT_LT(QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth).kept, 0.01);
}

TEST(PatchMatchEngine, PlanesAreFittedToWeakTextureAndLeftOutWhereItSuffices) {
  auto shots =
      Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0}), Facing({-kBaseline, 0, 0}),
                        Facing({0, kBaseline, 0}), Facing({0, -kBaseline, 0})});
  const PatchMatchEngine engine;
  const auto without_planes = [&] {
    const int before = engine.without_planes();
    engine.Estimate(ViewsOf(shots), 0, std::vector{1, 2, 3, 4}, kRange, {});
    return engine.without_planes() - before;
  };
  EXPECT_EQ(without_planes(), 1);
  // A patch of wall of one colour, as wide as the windows: from here on it is a thousandth of the
  // image and more that planes may help.
  for (Shot& shot : shots) {
    for (int y = 50; y < 70; ++y) std::fill_n(shot.image.row(y) + 3 * 70, 3 * 20, std::uint8_t{90});
  }
  EXPECT_EQ(without_planes(), 0);
}

TEST(PatchMatchEngine, ExposureDoesNotMatter) {
  auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  for (auto& value : shots[1].image.data()) {
    value = static_cast<std::uint8_t>(0.6 * value + 10);
  }
  const Quality q = QualityOf(EstimateFirst(ViewsOf(shots)), shots[0].truth);
  EXPECT_GT(q.kept, 0.75);
  EXPECT_LT(q.median_px, kMedianPx);
  EXPECT_LT(q.bad_share, 0.01);
}

TEST(PatchMatchEngine, RejectsAnEmptyRangeAndAWrongSize) {
  auto shots = Shots(Slanted(), {Facing({0, 0, 0}), Facing({kBaseline, 0, 0})});
  EXPECT_THROW(EstimateFirst(ViewsOf(shots), {4, 4}), Error);
  EXPECT_THROW(EstimateFirst(ViewsOf(shots), {0, 4}), Error);
  shots[1].image = ImageRgb8(kWidth, kHeight + 1, 3);
  EXPECT_THROW(EstimateFirst(ViewsOf(shots)), Error);
}

}  // namespace
}  // namespace dtr::stereo
