#include <gtest/gtest.h>

#include "tests/calib/validation/noisy_boards.h"

namespace dtr::calib {
namespace {

using namespace testing;

// What noise_test.cpp does with few noises and one draw.
TEST(BoardNoiseFull, CalibrationsPassAndFaultsAreFoundAtEveryNoise) {
  for (const std::uint64_t seed : {3, 4}) {
    for (const double noise_px : dtr::testing::kNoisesPx) {
      const ValidatedCalibration honest = Calibrated(BoardScene(), noise_px, seed);
      ExpectPassed(honest, noise_px);
      ExpectBoardFaultsFound(honest, noise_px);
    }
  }
}

TEST(BoardNoiseFull, RigsPassAndFaultsAreFoundAtEveryNoise) {
  for (const double noise_px : dtr::testing::kNoisesPx) {
    const ValidatedCalibration honest = Calibrated(RigScene(), noise_px, 3);
    ExpectPassed(honest, noise_px);
    ExpectRigFaultFound(honest, noise_px);
  }
}

}  // namespace
}  // namespace dtr::calib
