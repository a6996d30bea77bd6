// A few noises; noise_full_test.cpp has them all.
#include <gtest/gtest.h>

#include "tests/calib/validation/noisy_boards.h"

namespace dtr::calib {
namespace {

using namespace testing;

TEST(BoardNoise, ExactAndNoisyCalibrationsPassAndTheirFaultsAreFound) {
  for (const double noise_px : {0.0, 1.0}) {
    const ValidatedCalibration honest = Calibrated(BoardScene(), noise_px, 3);
    ExpectPassed(honest, noise_px);
    ExpectBoardFaultsFound(honest, noise_px);
  }
}

TEST(BoardNoise, ExactRigsPassAndTheirFaultsAreFound) {
  const ValidatedCalibration honest = Calibrated(RigScene(), 0, 3);
  ExpectPassed(honest, 0);
  ExpectRigFaultFound(honest, 0);
}

// Some views are exact beside others that are rounded: none is left out.
TEST(BoardNoise, SomeViewsMayBeExactAndOthersRounded) {
  constexpr double kRoundedPx = 1e-2;
  Scene scene = BoardScene();
  Random random(5);
  for (RigView& view : scene.views) {
    for (BoardCorner& corner : view.seen.corners) {
      const double x = random.Normal(), y = random.Normal();
      if (view.frame >= 8) corner.pixel += kRoundedPx * Eigen::Vector2d(x, y);
    }
  }
  ExpectPassed(Calibrated(scene, 0, 3), kRoundedPx);
}

}  // namespace
}  // namespace dtr::calib
