#include "calib/bundle/refine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/bundle/covariance.h"
#include "calib/bundle/held_out.h"
#include "calib/bundle/one_position.h"
#include "calib/colmap/model_io.h"
#include "calib/lens_groups.h"
#include "calib/similarity.h"
#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

using testing::MakeBundle;
using testing::ModelFrom;
using testing::SceneSpec;

// What a stabiliser of up to 10 px does to the observations of image i.
Eigen::Vector2d ShiftOf(int image) {
  return {10 * std::sin(2.4 * image), 7 * std::cos(1.7 * image)};
}

Bundle Stabilised(Bundle bundle, double share = 1) {
  for (BundleObservation& o : bundle.observations) o.pixel += share * ShiftOf(o.image);
  return bundle;
}

SceneSpec Noisy() { return {.points = 400, .noise_px = 0.3}; }

TEST(Refine, FreesThePrincipalPointWhereItIsWrong) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  model.cameras[1].params[1] += 12;  // as COLMAP leaves it: in the middle, and nothing adjusted
  const Refined refined = Refine(model, {});
  ASSERT_TRUE(refined.changed);
  EXPECT_EQ(refined.lens, LensFreedom::kAll);
  EXPECT_NEAR(refined.model.cameras.at(1).params[1], 504, 2);
}

TEST(Refine, FreesAPrincipalPointThatAllObservationsTellAndUnseenPointsDoNot) {
  // Features are of any sharpness, most good, few bad: what one point says of another is dull.
  Bundle bundle = MakeBundle(Noisy());
  Random random(11);  // of eight draws the one of which unseen points tell too little
  for (BundleObservation& o : bundle.observations) {
    const double noise_px = 2 * std::pow(random.Uniform(0, 1), 4);
    const double x = random.Normal(), y = random.Normal();
    o.pixel += noise_px * Eigen::Vector2d(x, y);
  }
  SfmModel model = ModelFrom(bundle);
  model.cameras[1].params[1] += 6;
  const Refined refined = Refine(model, {});
  ASSERT_TRUE(refined.changed);
  EXPECT_EQ(refined.lens, LensFreedom::kAll);
  EXPECT_NEAR(refined.model.cameras.at(1).params[1], 504, 3);
  ASSERT_EQ(refined.candidates[2].lens, LensFreedom::kAll);
  EXPECT_GE(refined.candidates[2].high_px2, 0) << "held-out points would do";
  EXPECT_GT(refined.candidates[2].principal_point_sigmas, 5);
}

TEST(Refine, TellsTheCovarianceOfEveryPoseAndLensWhereAsked) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  model.cameras[1].params[1] += 12;
  EXPECT_FALSE(Refine(model, {}).covariance.has_value());
  RefineOptions options;
  options.covariance = true;
  const auto json = nlohmann::json::parse(ToJson(Refine(model, options)))["covariance"];
  const AdjustOptions free = OptionsFor(LensFreedom::kAll);
  const BundleCovariance expected = CovarianceOf(Adjust(BundleOf(model), free), free);
  EXPECT_EQ(json["determined"], true);
  EXPECT_EQ(json["gauge_freedom"], 7);
  ASSERT_EQ(json["cameras"].size(), 8u);
  EXPECT_EQ(json["cameras"][3]["name"], model.images[3].name);
  for (long i = 0; i < 6; ++i) {
    for (long k = 0; k < 6; ++k) {
      EXPECT_EQ(json["cameras"][3]["matrix"][i][k], expected.OfImage(3)(i, k));
    }
  }
  const auto& lens = json["lenses"][0];
  EXPECT_EQ(lens["names"], (std::vector<std::string>{"f_px", "cx_px", "cy_px", "k1", "k2"}));
  EXPECT_EQ(lens["matrix"][1][2], expected.matrix(1, 2));
}

TEST(Refine, LeavesThePrincipalPointWhereTheDataDoNotAskForIt) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  model.cameras[1].params[0] *= 1.01;
  const Refined refined = Refine(model, {});
  ASSERT_TRUE(refined.changed);
  EXPECT_EQ(refined.lens, LensFreedom::kNoPrincipalPoint);
  EXPECT_EQ(refined.model.cameras.at(1).params[1], 504);
  EXPECT_NEAR(refined.model.cameras.at(1).params[0], 900, 2);
}

TEST(Refine, AddsTangentialDistortionWhereTheLensHasIt) {
  SceneSpec spec = Noisy();
  spec.lens = {CameraModel::kOpenCv, 1000, 800, {900, 900, 504, 397, -0.05, 0.01, 2e-3, -3e-3}};
  SfmModel model = ModelFrom(MakeBundle(spec));
  model.cameras[1] = {CameraModel::kRadial, 1000, 800, {900, 504, 397, -0.05, 0.01}};
  const Refined refined = Refine(model, {});
  ASSERT_TRUE(refined.changed);
  EXPECT_EQ(refined.lens, LensFreedom::kTangential);
  const LensCamera& lens = refined.model.cameras.at(1);
  ASSERT_EQ(lens.model, CameraModel::kOpenCv);
  EXPECT_NEAR(lens.params[6], 2e-3, 3e-4);
  EXPECT_NEAR(lens.params[7], -3e-3, 3e-4);
}

TEST(Refine, GivesEveryImageItsPrincipalPointWhereTheLensIsStabilised) {
  const Refined refined = Refine(ModelFrom(Stabilised(MakeBundle(Noisy()))), {});
  ASSERT_TRUE(refined.changed);
  EXPECT_EQ(refined.lens, LensFreedom::kPrincipalPointPerImage);
  EXPECT_NEAR(refined.adjusted.sigma_px, 0.3, 0.03);
  const SfmModel& model = refined.model;
  ASSERT_EQ(model.cameras.size(), model.images.size() + 1) << "the lens keeps its id";
  EXPECT_TRUE(SameButForPrincipalPoint(model.cameras.at(1), model.cameras.at(2)));
  EXPECT_NO_THROW(RequireDetermined(model, {}, "a camera that no image uses hurts nobody"));
  for (size_t i = 0; i < model.images.size(); ++i) {
    const LensCamera& camera = model.cameras.at(model.images[i].camera_id);
    const LensCamera& first = model.cameras.at(model.images[0].camera_id);
    EXPECT_EQ(camera.params[0], first.params[0]) << "one focal length";
    const Eigen::Vector2d apart = ShiftOf(static_cast<int>(i)) - ShiftOf(0);
    EXPECT_NEAR(camera.params[1] - first.params[1], apart.x(), 2) << i;
    EXPECT_NEAR(camera.params[2] - first.params[2], apart.y(), 2) << i;
  }
  // As one lens again, and settled: nothing is left to refine.
  EXPECT_EQ(BundleOf(model).lenses.size(), 1u);
  EXPECT_FALSE(Refine(model, {}).changed);
}

TEST(BundleOf, ViewsOfAStabilisedLensShareIt) {
  const Eigen::Vector2d at[] = {{320, 240}, {326, 240}, {323, 246}, {323, 234}};
  std::vector<PinholeCamera> cameras;
  for (const Eigen::Vector2d& centre : at) {
    cameras.emplace_back(640, 480, 500, 500, centre.x(), centre.y());
  }
  cameras.emplace_back(640, 480, 700, 700, 320, 240);
  const std::vector<std::string> names{"a", "b", "c", "d", "e"};
  const Bundle bundle = BundleOf(cameras, std::vector<Pose>(5), names, {});
  ASSERT_EQ(bundle.lenses.size(), 2u);
  EXPECT_EQ(bundle.lenses[0].params, (std::vector<double>{500, 500, 323, 240}));
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(bundle.images[i].lens, 0);
    EXPECT_EQ(bundle.images[i].shift_px, at[i] - Eigen::Vector2d(323, 240)) << i;
  }
  EXPECT_EQ(bundle.images[4].lens, 1);
}

// So little that other faults of a lens model do as much: sure, and not worth a number per image.
TEST(Refine, KeepsOnePrincipalPointWhereImagesGainNextToNothingByTheirOwn) {
  const Refined refined = Refine(ModelFrom(Stabilised(MakeBundle(Noisy()), 0.2)), {});
  ASSERT_GE(refined.candidates.size(), 5u);
  const RefineCandidate& own = refined.candidates[4];
  EXPECT_LT(own.high_px2, 0) << "no longer sure: the test tells nothing";
  EXPECT_LT(own.held_out_px, refined.candidates[2].held_out_px);
  EXPECT_NE(refined.lens, LensFreedom::kPrincipalPointPerImage);
}

TEST(Refine, LeavesATrueModelAlone) {
  const SfmModel model = ModelFrom(MakeBundle(Noisy()));
  const Refined refined = Refine(model, {});
  EXPECT_FALSE(refined.changed);
  EXPECT_FALSE(refined.reason.empty());
  EXPECT_EQ(refined.model.cameras.at(1).params, model.cameras.at(1).params);
}

// One lens, zoomed photo by photo: every focal length is found, and no principal point or
// distortion of each photo is freed for it.
TEST(Refine, ALensForEveryImageFreesItsFocalLengthAlone) {
  const auto zoom = [](size_t i) { return 1 + 0.4 * static_cast<double>(i % 3); };
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  const LensCamera lens = model.cameras.at(1);
  const Eigen::Vector2d centre(lens.params[1], lens.params[2]);
  for (size_t i = 0; i < model.images.size(); ++i) {
    const auto id = static_cast<std::uint32_t>(i + 1);
    model.images[i].camera_id = id;
    model.cameras[id] = lens;
    model.cameras[id].params[0] *= zoom(i) * (i % 2 == 0 ? 1.02 : 0.98);  // as they were voted
    for (SfmFeature& feature : model.images[i].features) {
      feature.pixel = centre + zoom(i) * (feature.pixel - centre);
    }
  }
  RefineOptions options;
  options.separate_lenses = true;
  const Refined refined = Refine(model, options);
  ASSERT_TRUE(refined.changed) << refined.reason;
  EXPECT_EQ(refined.lens, LensFreedom::kFocal) << ToJson(refined);
  for (size_t i = 0; i < model.images.size(); ++i) {
    const LensCamera& found = refined.model.cameras.at(refined.model.images[i].camera_id);
    EXPECT_NEAR(found.params[0] / (900 * zoom(i)), 1, 0.004) << i;
    EXPECT_EQ(found.params[1], lens.params[1]);
    EXPECT_EQ(found.params[3], lens.params[3]);
  }
}

TEST(Refine, TheSameForAnyNumberOfThreads) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  model.cameras[1].params[1] += 12;
  RefineOptions options;
  std::optional<ThreadLimit> limit;
  limit.emplace(1);
  const Refined one = Refine(model, options);
  limit.emplace(4);
  const Refined four = Refine(model, options);
  EXPECT_EQ(ToJson(one), ToJson(four));
  EXPECT_EQ(one.model.cameras.at(1).params, four.model.cameras.at(1).params);
  for (size_t i = 0; i < one.model.images.size(); ++i) {
    EXPECT_EQ(one.model.images[i].cam_from_world.translation,
              four.model.images[i].cam_from_world.translation);
  }
}

TEST(Refine, AKnownLensReplacesTheModels) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  const LensCamera known = model.cameras[1];
  model.cameras[1].params[0] *= 1.02;
  RefineOptions options;
  options.known_lenses = {{1, known}};
  const Refined refined = Refine(model, options);
  EXPECT_EQ(refined.model.cameras.at(1).params, known.params);
  EXPECT_LT(refined.adjusted.sigma_px, 0.32);
}

TEST(Refine, AKnownLensOfAnotherSizeIsRejected) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  LensCamera known = model.cameras[1];
  known.width_px *= 2;
  RefineOptions options;
  options.known_lenses = {{1, known}};
  EXPECT_THROW(Refine(model, options), Error);
}

TEST(Refine, SeparateLensesAreOnePerImage) {
  SfmModel model = ModelFrom(MakeBundle(Noisy()));
  model.cameras[1].params[0] *= 1.02;
  RefineOptions options;
  options.separate_lenses = true;
  const Refined refined = Refine(model, options);
  ASSERT_TRUE(refined.changed);
  EXPECT_EQ(refined.model.cameras.size(), model.images.size());
}

TEST(Refine, BracketsOfOnePositionConvergeAndHelpTheOthersNeitherMoreNorLess) {
  for (const double apart : {0.0, 1e-3, 0.1}) {
    const Bundle truth = MakeBundle(testing::Brackets(apart));
    const SfmModel model = ModelFrom(testing::Perturbed(truth, 0.01));
    const Refined refined = Refine(model, {});
    ASSERT_TRUE(refined.changed) << apart << ": " << refined.reason;
    EXPECT_NEAR(refined.solve.sigma_px, 0.3, 0.03) << apart;
    EXPECT_LT(refined.solve.iterations, 100) << apart;
    std::vector<Eigen::Vector3d> found, true_ones;
    for (size_t i = 0; i < truth.images.size(); ++i) {
      found.push_back(refined.model.images[i].cam_from_world.TargetOriginInSource());
      true_ones.push_back(truth.images[i].cam_from_world.TargetOriginInSource());
    }
    EXPECT_LT(AlignmentRms(AlignPoints(found, true_ones), found, true_ones), 0.02) << apart;
  }
}

// Exposure brackets of a drone: two photos from one position and four from another.
TEST(Refine, TheFieldCasesBracketsConvergeAsItsOtherPhotosDo) {
  const auto folder = dtr::testing::DataFolder() / "field/brackets_no_convergence/model";
  DTR_REQUIRE_DATA(folder);
  const Refined refined = Refine(colmap::ReadModel(folder), {});
  ASSERT_TRUE(refined.changed) << refined.reason;
  EXPECT_EQ(refined.lens, LensFreedom::kAll);
  EXPECT_LT(refined.solve.iterations, 100);
}

TEST(OnePosition, NamesThePhotosOfEachBracket) {
  const SfmModel model = ModelFrom(MakeBundle(testing::Brackets()));
  const std::vector<std::vector<int>> expected{{5, 6}, {8, 9, 10, 11}};
  EXPECT_EQ(ImagesOfOnePosition(model), expected);
  EXPECT_EQ(
      OnePositionLine(model),
      "6 photos share 2 positions (exposure brackets, bursts): image105 + image106; image108 + "
      "image109 + image110 + image111");
  EXPECT_EQ(OnePositionLine(ModelFrom(MakeBundle(Noisy()))), "");
}

TEST(OnePosition, FramesOfASlowVideoShareNone) {
  SceneSpec spec{.images = 12, .points = 400, .noise_px = 0.3};
  spec.point = testing::Walk().point;
  spec.pose = [](int i, int) {
    const Eigen::Vector3d centre(0.03 * i, 0, 2);  // of some 8.5 to what it sees
    return testing::bundle::LookAt(centre, centre + Eigen::Vector3d(0, 10, 0));
  };
  EXPECT_TRUE(ImagesOfOnePosition(ModelFrom(MakeBundle(spec))).empty());
}

TEST(Refine, TooFewPointsAreLeftAlone) {
  const Refined refined = Refine(ModelFrom(MakeBundle({.points = 50})), {});
  EXPECT_FALSE(refined.changed);
  EXPECT_NE(refined.reason.find("expected 100"), std::string::npos);
}

TEST(Refine, CamerasThatTurnOnTheSpotAreRejectedByName) {
  const SfmModel good = ModelFrom(MakeBundle(Noisy()));
  EXPECT_NO_THROW(RequireDetermined(good, {}, "model"));
  SceneSpec turning = Noisy();
  turning.pose = [](int i, int n) {
    return testing::LookAt({0, -6, 1}, {1.5 * (2.0 * i / (n - 1) - 1), 0, 0});
  };
  try {
    RequireDetermined(ModelFrom(MakeBundle(turning)), {}, "model");
    FAIL() << "nothing was rejected";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("pure_rotation"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace dtr::calib
