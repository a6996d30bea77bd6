#include "calib/validation/photos.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/calib/bundle/injected_faults.h"
#include "tests/support/on_threads.h"

namespace dtr::calib {
namespace {

using testing::AllFree;
using testing::FaultInjectionAll;
using testing::Honest;
using testing::kFaultInjections;
using testing::kPinholeLens;
using testing::LookAt;
using testing::MakeBundle;
using testing::SceneSpec;
using testing::Tally;

bool Names(const PhotosValidation& judgement, const std::string& degeneracy) {
  for (const Degeneracy& d : judgement.degeneracies) {
    if (d.name == degeneracy && d.harmful) return true;
  }
  return false;
}

TEST(ValidatePhotos, FaultInjectionsAreCaughtAndHonestSetsPass) {
  const Tally score = FaultInjectionAll(kFaultInjections, 2026);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.honest_passed, kFaultInjections);
  EXPECT_GE(score.caught, kFaultInjections - 2);
}

TEST(ValidatePhotos, HalvesDifferAsPredicted) {
  const PhotosValidation judgement = ValidatePhotos(Honest(77, 800), {});
  EXPECT_GT(judgement.halves_ratio, 0.5);
  EXPECT_LT(judgement.halves_ratio, 1.7);  // 7 cameras share lens and points: few independent ones
}

TEST(ValidatePhotos, PureRotationIsNamed) {
  SceneSpec spec{.images = 6, .points = 200, .lens = kPinholeLens, .noise_px = 0.3};
  spec.pose = [](int i, int) { return LookAt({0, -6, 1}, {0.4 * i - 1, 0, 0.2 * (i % 3)}); };
  const PhotosValidation judgement = ValidatePhotos(MakeBundle(spec), {});
  EXPECT_TRUE(Names(judgement, "pure_rotation")) << ToJson(judgement);
  EXPECT_FALSE(AllPassed(judgement.tests));
}

// Every image turned a little, and its principal point moved as far: observations hardly tell.
TEST(ValidatePhotos, PrincipalPointsOfSinglePhotosFailWhereTheyAreOpen) {
  SceneSpec spec{.images = 6, .points = 150, .lens = kPinholeLens, .noise_px = 0.5};
  spec.pose = [](int i, int n) {
    const double angle = -0.3 + 0.6 * i / (n - 1);
    return LookAt({6 * std::sin(angle), -6 * std::cos(angle), 1}, {0, 0, 0});
  };
  Bundle bundle = MakeBundle(spec);
  bundle.lenses.assign(bundle.images.size(), kPinholeLens);
  const auto terms = [&](const BundleLimits& limits) {
    for (const Check& test : ValidatePhotos(bundle, limits).tests) {
      if (test.name == "undetermined_terms") return test;
    }
    return Check{};
  };
  for (size_t i = 0; i < bundle.images.size(); ++i) bundle.images[i].lens = static_cast<int>(i);
  EXPECT_TRUE(terms({}).passed) << terms({}).reason;
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    const double moved_px = i % 2 == 0 ? 40 : -40;
    bundle.lenses[i].params[2] += moved_px;
    const Eigen::AngleAxisd turn(std::atan(-moved_px / bundle.lenses[i].params[0]),
                                 Eigen::Vector3d::UnitY());
    Pose& pose = bundle.images[i].cam_from_world;
    pose.rotation = (Eigen::Quaterniond(turn) * pose.rotation).normalized();
    pose.translation = turn * pose.translation;
  }
  AdjustOptions held;
  held.lens = LensFreedom::kNoPrincipalPoint;
  bundle = Adjust(bundle, held).bundle;
  const Check open = terms({});
  EXPECT_FALSE(open.passed) << open.reason;
  EXPECT_NE(open.reason.find("principal points of image10"), std::string::npos) << open.reason;
  EXPECT_TRUE(terms({.lenses_are_given = true}).passed) << "a rig's were calibrated apart";
}

TEST(ValidatePhotos, DegenerateWaysAreRecognised) {
  SceneSpec spec{.images = 6, .points = 300, .lens = kPinholeLens, .noise_px = 0.3};
  spec.pose = [](int i, int) { return LookAt({0.3 * i, -6 + 0.0 * i, 1}, {0.3 * i, 0, 1}); };
  const auto recognised = [&](const char* name) {
    const PhotosValidation judgement = ValidatePhotos(MakeBundle(spec), {});
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

TEST(ValidatePhotos, OrdinaryScenesHaveNoDegeneracy) {
  const PhotosValidation judgement = ValidatePhotos(Honest(5), {});
  EXPECT_TRUE(judgement.degeneracies.empty()) << ToJson(judgement);
  EXPECT_GT(judgement.condition, 1);
  EXPECT_LT(judgement.cameras[0].image_shift_px, 1);
}

TEST(ValidatePhotos, TheSameForAnyNumberOfThreads) {
  const Bundle bundle = Honest(6);
  EXPECT_EQ(ToJson(OnThreads(1, [&] { return ValidatePhotos(bundle, {}); })),
            ToJson(OnThreads(4, [&] { return ValidatePhotos(bundle, {}); })));
}

const Check* TestOf(const PhotosValidation& judgement, const std::string& name) {
  for (const Check& test : judgement.tests) {
    if (test.name == name) return &test;
  }
  return nullptr;
}

TEST(ValidatePhotos, TooFewPointsFailAndSayWhy) {
  const PhotosValidation judgement =
      ValidatePhotos(MakeBundle({.points = 20, .lens = kPinholeLens}), {});
  EXPECT_THAT(judgement.not_validated, ::testing::HasSubstr("expected 50 points"));
  const Check* test = TestOf(judgement, "photos_not_validated");
  ASSERT_NE(test, nullptr);
  EXPECT_FALSE(test->passed);
  EXPECT_EQ(test->value, 8);
  EXPECT_THAT(test->reason, ::testing::HasSubstr("expected 50 points"));
  EXPECT_TRUE(TestOf(ValidatePhotos(Honest(6), {}), "photos_not_validated")->passed);
}

TEST(ValidatePhotos, APhotoOfFewObservationsLeavesTheHalvesToTheOthers) {
  Bundle bundle = Honest(8);
  int seen = 0;
  std::erase_if(bundle.observations,
                [&](const BundleObservation& o) { return o.image == 3 && ++seen > 20; });
  const PhotosValidation judgement = ValidatePhotos(bundle, {});
  const Check* test = TestOf(judgement, "halves_ratio");
  ASSERT_NE(test, nullptr);
  EXPECT_TRUE(test->passed) << test->reason;
  EXPECT_GT(test->value, 0.3);
  EXPECT_THAT(test->reason, ::testing::HasSubstr(bundle.images[3].name));
}

TEST(ValidatePhotos, APhotoOfFewObservationsAmongManyPointsKeepsThemAll) {
  Bundle bundle = MakeBundle({.images = 6, .points = 9000, .lens = kPinholeLens, .noise_px = 0.3});
  int seen = 0;
  std::erase_if(bundle.observations,
                [&](const BundleObservation& o) { return o.image == 3 && ++seen > 40; });
  const PhotosValidation judgement = ValidatePhotos(bundle, {});
  // Of 4000 points drawn it would have 18 observations: too few for halves, and by chance for
  // anything.
  EXPECT_THAT(TestOf(judgement, "halves_ratio")->reason,
              ::testing::Not(::testing::HasSubstr(bundle.images[3].name)));
  EXPECT_EQ(judgement.cameras.size(), 6u);
  EXPECT_TRUE(TestOf(judgement, "photos_not_validated")->passed);
}

TEST(ValidatePhotos, MoreThanOnePartHoldsIsValidatedInParts) {
  const SceneSpec spec{
      .images = 60, .points = 500, .lens = kPinholeLens, .noise_px = 0.3, .max_observations = 8};
  const Bundle honest = Adjust(MakeBundle(spec), AllFree()).bundle;
  BundleLimits limits;
  limits.max_unknowns = 500;
  const PhotosValidation judgement = ValidatePhotos(honest, limits);
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
    const PhotosValidation bad = ValidatePhotos(spoiled, limits);
    const Check* test = TestOf(bad, "camera_difference_sigmas");
    ASSERT_NE(test, nullptr);
    EXPECT_FALSE(test->passed);
    EXPECT_THAT(test->reason, ::testing::HasSubstr(spoiled.images[image].name));
  }
}

}  // namespace
}  // namespace dtr::calib
