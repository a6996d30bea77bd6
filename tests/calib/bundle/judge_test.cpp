#include "calib/bundle/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

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
  spec.max_observations = 2;
  EXPECT_TRUE(recognised("tracks_of_two"));
}

TEST(Judge, OrdinaryScenesHaveNoDegeneracy) {
  const Judgement judgement = Judge(Honest(5), {});
  EXPECT_TRUE(judgement.degeneracies.empty()) << ToJson(judgement);
  EXPECT_GT(judgement.condition, 1);
  EXPECT_LT(judgement.cameras[0].image_shift_px, 1);
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

TEST(Judge, APhotoOfFewObservationsLeavesTheHalvesToTheOthers) {
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

TEST(Judge, APhotoOfFewObservationsAmongManyPointsKeepsThemAll) {
  Bundle bundle = MakeBundle({.images = 6, .points = 9000, .lens = kPinholeLens, .noise_px = 0.3});
  int seen = 0;
  std::erase_if(bundle.observations,
                [&](const BundleObservation& o) { return o.image == 3 && ++seen > 40; });
  const Judgement judgement = Judge(bundle, {});
  // Of 4000 points drawn it would have 18 observations: too few for halves, and by chance for
  // anything.
  EXPECT_THAT(TestOf(judgement, "halves_ratio")->reason,
              ::testing::Not(::testing::HasSubstr(bundle.images[3].name)));
  EXPECT_EQ(judgement.cameras.size(), 6u);
  EXPECT_TRUE(TestOf(judgement, "photos_not_judged")->passed);
}

TEST(Judge, MoreThanCanBeJudgedAtOnceIsJudgedInParts) {
  const SceneSpec spec{
      .images = 60, .points = 500, .lens = kPinholeLens, .noise_px = 0.3, .max_observations = 8};
  const Bundle honest = Adjust(MakeBundle(spec), AllFree()).bundle;
  BundleLimits limits;
  limits.max_unknowns = 500;
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
