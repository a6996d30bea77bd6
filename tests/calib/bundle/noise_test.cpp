#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "calib/bundle/refine.h"
#include "calib/colmap/model_io.h"
#include "tests/calib/bundle/noise_sweep.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

using testing::Fault;
using testing::kNoisesPx;
using testing::NoisyScene;
using testing::SceneKind;
using testing::SceneSpec;
using testing::ValidationOf;

TEST(NoiseSweep, HonestModelsPassAtEveryNoise) {
  for (const SceneKind kind : testing::kSceneKinds) {
    const bool all = kind == SceneKind::kArc || kind == SceneKind::kOrbit;
    for (const double noise_px : all ? kNoisesPx : testing::kFewNoisesPx) {
      const auto tests = ValidationOf(NoisyScene(kind, noise_px, 11, 150), noise_px);
      EXPECT_TRUE(AllPassed(tests))
          << NameOf(kind) << ", noise " << noise_px << " px: " << testing::BrokenTests(tests);
    }
  }
}

TEST(NoiseSweep, FaultsFailAtEveryNoise) {
  for (const Fault fault : testing::kFaults) {
    for (const double noise_px : testing::kFewNoisesPx) {
      const Bundle honest = NoisyScene(SceneKind::kArc, noise_px, 12, 150);
      const auto tests =
          ValidationOf(WithFault(honest, fault, testing::ClearlySeenPx(noise_px)), noise_px);
      EXPECT_FALSE(AllPassed(tests)) << NameOf(fault) << ", noise " << noise_px << " px";
      // For the right reason: what was found, not that nothing could be.
      for (const Check& test : tests) {
        if (test.name == "photos_not_validated") {
          EXPECT_TRUE(test.passed)
              << NameOf(fault) << ", noise " << noise_px << ": " << test.reason;
        }
      }
    }
  }
}

TEST(NoiseSweep, WhatIsUndeterminedFailsAtEveryNoise) {
  SceneSpec turning{.images = 6, .points = 150, .lens = testing::kPinholeOfSweep};
  turning.pose = [](int i, int) {
    return testing::LookAt({0, -6, 1}, {0.4 * i - 1, 0, 0.2 * (i % 3)});
  };
  SceneSpec chain{.points = 150, .lens = testing::kPinholeOfSweep, .max_observations = 2};
  for (SceneSpec* spec : {&turning, &chain}) {
    for (const double noise_px : testing::kFewNoisesPx) {
      spec->noise_px = noise_px;
      const auto tests = ValidationOf(testing::MakeBundle(*spec), noise_px);
      EXPECT_NE(testing::BrokenTest(tests, "degeneracies"), nullptr)
          << (spec == &turning ? "turning on the spot" : "pairs in a row") << ", noise " << noise_px
          << " px";
    }
  }
}

// Photos whose pixels are exact beside photos whose pixels are rounded: none is an outlier.
TEST(NoiseSweep, SomePhotosMayBeExactAndOthersRounded) {
  for (const double noise_px : {1e-4, 1e-3, 1e-2}) {
    Bundle bundle = NoisyScene(SceneKind::kArc, 0, 13, 150);
    Random random(5);
    for (BundleObservation& o : bundle.observations) {
      const double x = random.Normal(), y = random.Normal();
      if (o.image >= 4) o.pixel += noise_px * Eigen::Vector2d(x, y);
    }
    const auto tests = ValidationOf(bundle, noise_px);
    EXPECT_TRUE(AllPassed(tests)) << noise_px << " px: " << testing::BrokenTests(tests);
  }
}

TEST(NoiseSweep, AnOrbitAtOneHeightLeavesIntrinsicsOpenAndSaysSo) {
  const auto names = [](SceneKind kind, double noise_px) {
    std::string found;
    for (const Degeneracy& d :
         ValidatePhotos(NoisyScene(kind, noise_px, 15, 150), {}).degeneracies) {
      found += d.name + (d.harmful ? " harmful " : " ");
    }
    return found;
  };
  for (const double noise_px : {0.0, 1e-3, 0.1}) {
    EXPECT_EQ(names(SceneKind::kOrbit, noise_px), "open_principal_point ") << noise_px;
    EXPECT_EQ(names(SceneKind::kTurntable, noise_px), "open_principal_point open_aspect_ratio ")
        << noise_px;
  }
}

// Nothing is gained on exact observations, and nothing forbids to ask.
TEST(NoiseSweep, RefineLeavesExactModelsAsTheyAre) {
  for (const SceneKind kind : {SceneKind::kArc, SceneKind::kTurntable}) {
    for (const double noise_px : {0.0, 1e-9, 1e-6, 1e-4}) {
      const SfmModel model = testing::ModelFrom(NoisyScene(kind, noise_px, 16, 150));
      RefineOptions options;
      options.determined = "here";
      const Refined refined = Refine(model, options);
      EXPECT_FALSE(refined.changed) << NameOf(kind) << ", noise " << noise_px;
      EXPECT_EQ(refined.reason, "held-out observations are predicted no better");
    }
  }
}

// Worlds of other sizes and places, as UTM coordinates are, change nothing.
TEST(NoiseSweep, TheWorldsScaleAndOriginDoNotMatter) {
  struct World {
    const char* name;
    double scale, offset;
  };
  for (const World& world : {World{"1e-6", 1e-6, 0}, World{"1e6", 1e6, 0}, World{"UTM", 1, 5e6}}) {
    Similarity moved;
    moved.scale = world.scale;
    moved.translation = Eigen::Vector3d(0.1 * world.offset, world.offset, 100);
    for (const double noise_px : {0.0, 1e-3, 0.3}) {
      const Bundle bundle = NoisyScene(SceneKind::kArc, noise_px, 14, 150);
      const auto here = ValidationOf(bundle, noise_px);
      const auto there = ValidationOf(testing::Moved(bundle, moved), noise_px);
      EXPECT_TRUE(AllPassed(there))
          << world.name << ", noise " << noise_px << " px: " << testing::BrokenTests(there);
      ASSERT_EQ(here.size(), there.size());
      for (size_t i = 0; i < here.size() && noise_px == 0.3; ++i) {
        EXPECT_NEAR(here[i].value, there[i].value, 1e-3 + 0.01 * std::abs(here[i].value))
            << world.name << ": " << here[i].name;
      }
      const auto fault = testing::WithFault(bundle, Fault::kMovedCamera, 20);
      EXPECT_FALSE(AllPassed(ValidationOf(testing::Moved(fault, moved), noise_px))) << world.name;
    }
  }
}

// Public case: six cameras, a third of the points seen by two of them only.
TEST(NoiseSweep, TheExactModelOfTheFieldCasePasses) {
  const auto folder = testing::DataFolder() / "field" / "validate_exact";
  for (const char* name : {"model_exact", "model_noise_1e-06", "model_noise_0.001"}) {
    DTR_REQUIRE_DATA(folder / name);
    const auto tests = ValidationOf(BundleOf(colmap::ReadModel(folder / name)), 0);
    EXPECT_TRUE(AllPassed(tests)) << name << ": " << testing::BrokenTests(tests);
  }
}

}  // namespace
}  // namespace dtr::calib
