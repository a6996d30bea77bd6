// What of residuals follows a pattern, and what is noise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "calib/bundle/lens_patterns.h"
#include "calib/bundle/shutter.h"
#include "calib/residual_patterns.h"
#include "tests/calib/bundle/sabotage.h"

namespace dtr::calib {
namespace {

using testing::AllFree;
using testing::Honest;
using testing::kPinholeLens;
using testing::MakeBundle;
using testing::Ripple;

struct Patterns {
  LensPatternTest radial, regional;
  ShutterTest shutter;
};

Patterns PatternsOf(const Bundle& bundle) {
  const Adjusted adjusted = Adjust(bundle, AllFree());
  const BundleCovariance layout = CovarianceOf(adjusted, AllFree());
  return {TestRadialPattern(adjusted, layout), TestRegionalPattern(adjusted, layout),
          TestShutter(adjusted, layout)};
}

// A lens that grows and shrinks by this much along the radius, twice as far as its corners.
void BendRadially(double height_px, Bundle& bundle) {
  for (BundleObservation& o : bundle.observations) {
    const LensCamera& lens = bundle.lenses[0];
    const Eigen::Vector2d from_middle =
        o.pixel - Eigen::Vector2d(0.5 * lens.width_px, 0.5 * lens.height_px);
    const double share = 2 * from_middle.norm() / std::hypot(lens.width_px, lens.height_px);
    o.pixel += height_px * std::sin(4 * EIGEN_PI * share) * from_middle.normalized();
  }
}

// How many tests have a p below 1/2 and below 1/10. Of 40 draws of noise binomial: 20 +- 3.2 and
// 4 +- 1.9; 3.5 sigmas.
struct Rarity {
  int below_half = 0, below_a_tenth = 0;
  void Add(const WiderFit& fit) {
    below_half += fit.p < 0.5;
    below_a_tenth += fit.p < 0.1;
  }
  void ExpectThatOfNoise() const {
    EXPECT_NEAR(below_half, 20, 11);
    EXPECT_LE(below_a_tenth, 10);
  }
};

TEST(Patterns, OfNoiseEveryShareOfTheTestsIsAsRareAsItsP) {
  Rarity radial, regional, shutter;
  for (std::uint64_t draw = 0; draw < 40; ++draw) {
    const Patterns patterns = PatternsOf(MakeBundle(
        {.images = 6, .points = 150, .lens = kPinholeLens, .noise_px = 0.3, .seed = 900 + draw}));
    ASSERT_EQ(patterns.shutter.fit.freedom, 18);
    radial.Add(patterns.radial.fit);
    regional.Add(patterns.regional.fit);
    shutter.Add(patterns.shutter.fit);
  }
  radial.ExpectThatOfNoise();
  regional.ExpectThatOfNoise();
  shutter.ExpectThatOfNoise();
}

TEST(Patterns, WhatTheLensFollowsIsNoneOfThem) {
  const Patterns patterns = PatternsOf(Honest(7));
  // Six rings; a focal length is taken: radial growth by the radius.
  EXPECT_LE(patterns.radial.fit.freedom, kRings);
  EXPECT_GE(patterns.radial.fit.freedom, kRings - 2);
  // A common shift in either axis is the principal point.
  EXPECT_LE(patterns.regional.fit.freedom, 2 * kPatternRegions * kPatternRegions);
  EXPECT_GE(patterns.regional.fit.freedom, 2 * kPatternRegions * kPatternRegions - 8);
  EXPECT_EQ(patterns.shutter.fit.freedom, 3 * 7);
}

TEST(Patterns, TurnsAreFoundAndMeasured) {
  Bundle seen =
      MakeBundle({.images = 7, .points = 400, .lens = kPinholeLens, .noise_px = 0.1, .seed = 3});
  // The third camera alone turns, by half a degree from its first row to its last.
  const Eigen::Vector3d turn(0.003, -0.008, 0.002);
  for (BundleObservation& o : seen.observations) {
    if (o.image != 2) continue;
    const Eigen::Vector3d p =
        seen.images[2].cam_from_world * seen.points[static_cast<size_t>(o.point)].hnormalized();
    const Eigen::Vector3d w = (o.pixel.y() / kPinholeLens.height_px - 0.5) * turn;
    o.pixel += *kPinholeLens.PixelFromCam(Eigen::AngleAxisd(w.norm(), w.normalized()) * p) -
               *kPinholeLens.PixelFromCam(p);
  }
  AdjustOptions all = AllFree();
  all.outlier_sigmas = 0;
  const Adjusted adjusted = Adjust(seen, all);
  const ShutterTest test = TestShutter(adjusted, CovarianceOf(adjusted, all));
  EXPECT_LT(test.fit.p, 1e-12);
  EXPECT_EQ(std::max_element(test.sigmas.begin(), test.sigmas.end()) - test.sigmas.begin(), 2);
  EXPECT_NEAR(test.turns_rad[2], turn.norm(), 0.1 * turn.norm());
}

TEST(Patterns, ALensBeyondItsModelIsSeenAlongTheRadius) {
  Bundle bundle = Honest(11);
  BendRadially(1, bundle);
  const Patterns patterns = PatternsOf(bundle);
  EXPECT_LT(patterns.radial.fit.p, 1e-10);
  EXPECT_GT(patterns.radial.fit.amplitude_px, 0.1);
}

TEST(Patterns, AWavyLensIsSeenByRegions) {
  Bundle bundle = Honest(12);
  Ripple(1, bundle);
  const Patterns patterns = PatternsOf(bundle);
  EXPECT_LT(patterns.regional.fit.p, 1e-10);
  EXPECT_GT(patterns.regional.fit.amplitude_px, 0.3);
  const Judgement judgement = Judge(bundle, {});
  const auto test = std::find_if(judgement.tests.begin(), judgement.tests.end(),
                                 [](const Check& c) { return c.name == "regional_pattern_px"; });
  ASSERT_NE(test, judgement.tests.end());
  EXPECT_FALSE(test->passed) << test->reason;
}

// A lens for every photo, and room for few of their unknowns: those with most observations are
// tested.
TEST(Patterns, OfTooManyLensesThoseWithMostObservationsAreTested) {
  Bundle bundle = MakeBundle({.images = 60, .points = 900, .noise_px = 0.3, .max_observations = 8});
  const LensCamera lens = bundle.lenses[0];
  bundle.lenses.assign(bundle.images.size(), lens);
  for (size_t i = 0; i < bundle.images.size(); ++i) bundle.images[i].lens = static_cast<int>(i);
  const Adjusted adjusted = Adjust(bundle, AllFree());
  const BundleCovariance layout = CovarianceOf(adjusted, AllFree());
  const int fit = static_cast<int>(MostExtra(layout)) / (2 * kPatternRegions * kPatternRegions);
  ASSERT_LT(fit, 60);
  ASSERT_GT(fit, 10);
  const LensPatternTest test = TestRegionalPattern(adjusted, layout);
  EXPECT_EQ(test.lenses_left_out, 60 - fit);
  EXPECT_TRUE(test.fit.not_tested.empty()) << test.fit.not_tested;
  EXPECT_GT(test.fit.p, 1e-4);
}

}  // namespace
}  // namespace dtr::calib
