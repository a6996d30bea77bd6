#include "calib/bundle/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/calib/bundle/sabotage.h"

namespace dtr::calib {
namespace {

using testing::Honest;
using testing::kPinholeLens;
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
  const Tally score = SabotageAll(7, 2026);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.honest_passed, 7);
  EXPECT_GE(score.caught, 5);
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

TEST(Judge, TooFewPointsAreNotJudged) {
  const Judgement judgement = Judge(MakeBundle({.points = 20, .lens = kPinholeLens}), {});
  EXPECT_TRUE(judgement.tests.empty());
  EXPECT_THAT(judgement.not_judged, ::testing::HasSubstr("expected 50 points"));
}

}  // namespace
}  // namespace dtr::calib
