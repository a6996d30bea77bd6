#include <gtest/gtest.h>

#include "tests/calib/bundle/noise_sweep.h"

namespace dtr::calib {
namespace {

using testing::Fault;
using testing::kNoisesPx;
using testing::NoisyScene;
using testing::SceneKind;
using testing::ValidationOf;

// What noise_test.cpp does with few points and one draw.
TEST(NoiseSweep, HonestModelsPassAndFaultsFailForEverySeedSceneAndNoise) {
  const auto& few = testing::kFewNoisesPx;
  for (const std::uint64_t seed : {21, 22}) {
    for (const SceneKind kind : testing::kSceneKinds) {
      for (const double noise_px : kNoisesPx) {
        const Bundle honest = NoisyScene(kind, noise_px, seed, 300);
        const auto tests = ValidationOf(honest, noise_px);
        EXPECT_TRUE(AllPassed(tests)) << NameOf(kind) << ", seed " << seed << ", noise " << noise_px
                                      << " px: " << testing::BrokenTests(tests);
        if (std::find(few.begin(), few.end(), noise_px) == few.end()) continue;
        for (const Fault fault : testing::kFaults) {
          EXPECT_FALSE(AllPassed(ValidationOf(
              testing::WithFault(honest, fault, testing::ClearlySeenPx(noise_px)), noise_px)))
              << NameOf(fault) << ", " << NameOf(kind) << ", seed " << seed << ", noise "
              << noise_px << " px";
        }
      }
    }
  }
}

}  // namespace
}  // namespace dtr::calib
