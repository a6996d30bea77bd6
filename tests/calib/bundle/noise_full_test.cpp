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
  for (const std::uint64_t seed : {21, 22, 23, 24}) {
    for (const SceneKind kind : testing::kSceneKinds) {
      for (const double noise_px : kNoisesPx) {
        const Bundle honest = NoisyScene(kind, noise_px, seed, 300);
        const auto tests = ValidationOf(honest, noise_px);
        EXPECT_TRUE(AllPassed(tests)) << NameOf(kind) << ", seed " << seed << ", noise " << noise_px
                                      << " px: " << testing::BrokenTests(tests);
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
