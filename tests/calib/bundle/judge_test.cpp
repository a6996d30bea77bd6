#include "calib/bundle/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/bundle/shutter.h"
#include "tests/calib/bundle/sabotage.h"

namespace dtr::calib {
namespace {

using testing::AllFree;
using testing::Honest;
using testing::kPinholeLens;
using testing::kSabotages;
using testing::LookAt;
using testing::MakeBundle;
using testing::SabotageAll;
using testing::SceneSpec;
using testing::Tally;

bool Names(const Judgement& judgement, const std::string& degeneracy) {
  for (const Degeneracy& d : judgement.degeneracies) {
    if (d.name == degeneracy && d.harmful) return true;
  }
  return false;
}

TEST(Judge, SabotagesAreCaughtAndHonestSetsPass) {
  const Tally score = SabotageAll(kSabotages, 2026);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.honest_passed, kSabotages);
  EXPECT_GE(score.caught, kSabotages - 2);
}

TEST(Judge, HalvesDifferAsPredicted) {
  const Judgement judgement = Judge(Honest(77, 800), {});
  EXPECT_GT(judgement.halves_ratio, 0.5);
  EXPECT_LT(judgement.halves_ratio, 1.7);  // 7 cameras share lens and points: few independent ones
}

ShutterTest ShutterOf(const Bundle& seen) {
  const Adjusted adjusted = Adjust(seen, AllFree());
  return TestShutter(adjusted, CovarianceOf(adjusted, AllFree()));
}

TEST(Shutter, OfNoiseEveryShareOfTheTestsIsAsRareAsItsP) {
  constexpr int kDraws = 40;
  int below_half = 0, below_a_tenth = 0;
  for (int k = 0; k < kDraws; ++k) {
    const ShutterTest test = ShutterOf(MakeBundle({.images = 6,
                                                   .points = 150,
                                                   .lens = kPinholeLens,
                                                   .noise_px = 0.3,
                                                   .seed = 900 + static_cast<std::uint64_t>(k)}));
    ASSERT_EQ(test.freedom, 18);
    below_half += test.p < 0.5;
    below_a_tenth += test.p < 0.1;
  }
  // Binomial: 20 +- 3.2 and 4 +- 1.9; 3.5 sigmas.
  EXPECT_NEAR(below_half, 20, 11);
  EXPECT_LE(below_a_tenth, 10);
}

TEST(Shutter, TurnsAreFoundAndMeasured) {
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
  EXPECT_LT(test.p, 1e-12);
  EXPECT_EQ(std::max_element(test.sigmas.begin(), test.sigmas.end()) - test.sigmas.begin(), 2);
  EXPECT_NEAR(test.turns_rad[2], turn.norm(), 0.1 * turn.norm());
}

TEST(Judge, PureRotationIsNamed) {
  SceneSpec spec{.images = 6, .points = 200, .lens = kPinholeLens, .noise_px = 0.3};
  spec.pose = [](int i, int) { return LookAt({0, -6, 1}, {0.4 * i - 1, 0, 0.2 * (i % 3)}); };
  const Judgement judgement = Judge(MakeBundle(spec), {});
  EXPECT_TRUE(Names(judgement, "pure_rotation")) << ToJson(judgement);
  EXPECT_FALSE(AllPassed(judgement.tests));
}

TEST(Judge, DegenerateWaysAreRecognised) {
  SceneSpec spec{.images = 6, .points = 300, .lens = kPinholeLens, .noise_px = 0.3};
  spec.pose = [](int i, int) { return LookAt({0.3 * i, -6 + 0.0 * i, 1}, {0.3 * i, 0, 1}); };
  const auto recognised = [&](const char* name) {
    const Judgement judgement = Judge(MakeBundle(spec), {});
    for (const Check& test : judgement.tests) EXPECT_FALSE(std::isnan(test.value)) << test.name;
    return std::any_of(judgement.degeneracies.begin(), judgement.degeneracies.end(),
                       [&](const Degeneracy& d) { return d.name == name; });
  };
  EXPECT_TRUE(recognised("collinear_centres"));
  spec.pose = [](int i, int) { return LookAt({0, -9.0 + 0.5 * i, 0.5}, {0, 0, 0.5}); };
  EXPECT_TRUE(recognised("forward_motion"));
  spec.pose = {};
  spec.most_sights = 2;
  EXPECT_TRUE(recognised("tracks_of_two"));
}

TEST(Judge, OrdinaryScenesHaveNoDegeneracy) {
  const Judgement judgement = Judge(Honest(5), {});
  EXPECT_TRUE(judgement.degeneracies.empty()) << ToJson(judgement);
  EXPECT_GT(judgement.condition, 1);
  EXPECT_LT(judgement.cameras[0].picture_shift_px, 1);
}

TEST(Judge, TheSameForAnyNumberOfThreads) {
  const Bundle bundle = Honest(6);
  EXPECT_EQ(ToJson(Judge(bundle, {}, 1)), ToJson(Judge(bundle, {}, 4)));
}

const Check* TestOf(const Judgement& judgement, const std::string& name) {
  for (const Check& test : judgement.tests) {
    if (test.name == name) return &test;
  }
  return nullptr;
}

TEST(Judge, TooFewPointsFailAndSayWhy) {
  const Judgement judgement = Judge(MakeBundle({.points = 20, .lens = kPinholeLens}), {});
  EXPECT_THAT(judgement.not_judged, ::testing::HasSubstr("expected 50 points"));
  const Check* test = TestOf(judgement, "photos_not_judged");
  ASSERT_NE(test, nullptr);
  EXPECT_FALSE(test->passed);
  EXPECT_EQ(test->value, 8);
  EXPECT_THAT(test->reason, ::testing::HasSubstr("expected 50 points"));
  EXPECT_TRUE(TestOf(Judge(Honest(6), {}), "photos_not_judged")->passed);
}

TEST(Judge, APhotoOfFewSightsLeavesTheHalvesToTheOthers) {
  Bundle bundle = Honest(8);
  int seen = 0;
  std::erase_if(bundle.observations,
                [&](const BundleObservation& o) { return o.image == 3 && ++seen > 20; });
  const Judgement judgement = Judge(bundle, {});
  const Check* test = TestOf(judgement, "halves_ratio");
  ASSERT_NE(test, nullptr);
  EXPECT_TRUE(test->passed) << test->reason;
  EXPECT_GT(test->value, 0.3);
  EXPECT_THAT(test->reason, ::testing::HasSubstr(bundle.images[3].name));
}

TEST(Judge, MoreThanCanBeJudgedAtOnceIsJudgedInParts) {
  const SceneSpec spec{
      .images = 60, .points = 500, .lens = kPinholeLens, .noise_px = 0.3, .most_sights = 8};
  const Bundle honest = Adjust(MakeBundle(spec), AllFree()).bundle;
  BundleLimits limits;
  limits.most_unknowns = 500;
  const Judgement judgement = Judge(honest, limits);
  EXPECT_GT(judgement.parts, 2);
  EXPECT_EQ(judgement.cameras.size(), 60u);
  for (const Check& test : judgement.tests) {
    EXPECT_TRUE(test.passed) << test.name << " " << test.value << ": " << test.reason;
  }
  ASSERT_NE(TestOf(judgement, "rolling_shutter_px"), nullptr);
  // What is wrong in one part is wrong, and named.
  for (const size_t image : {size_t{2}, size_t{57}}) {
    Bundle spoiled = honest;
    Pose& pose = spoiled.images[image].cam_from_world;
    pose.rotation = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()) * pose.rotation;
    const Judgement bad = Judge(spoiled, limits);
    const Check* test = TestOf(bad, "camera_difference_sigmas");
    ASSERT_NE(test, nullptr);
    EXPECT_FALSE(test->passed);
    EXPECT_THAT(test->reason, ::testing::HasSubstr(spoiled.images[image].name));
  }
}

}  // namespace
}  // namespace dtr::calib
