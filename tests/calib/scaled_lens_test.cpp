#include "calib/scaled_lens.h"

#include <gtest/gtest.h>

#include "tests/calib/lens_models.h"

namespace dtr::calib {
namespace {

constexpr double kRoundingPx = 1e-9;

// A pixel of a scaled photo is the scaled pixel, whatever the model.
TEST(ScaledLens, PixelsScaleWithThePhoto) {
  Random random(5);
  for (const CameraModel model : testing::kAllModels) {
    const LensCamera lens = testing::RandomLens(model, random);
    for (const double scale : {0.25, 0.5, 3.0}) {
      const auto scaled = ScaledLens(lens, static_cast<int>(scale * lens.width_px),
                                     static_cast<int>(scale * lens.height_px));
      ASSERT_TRUE(scaled) << NameOf(model);
      for (int k = 0; k < 20; ++k) {
        const Eigen::Vector3d p(random.Uniform(-0.4, 0.4), random.Uniform(-0.3, 0.3), 1);
        const auto full = lens.PixelFromCam(p), small = scaled->PixelFromCam(p);
        ASSERT_EQ(full.has_value(), small.has_value()) << NameOf(model);
        if (!full) continue;
        EXPECT_LT((scale * *full - *small).norm(), kRoundingPx) << NameOf(model);
      }
    }
  }
}

TEST(ScaledLens, RoundedSizesAreTheSameShapeAndCroppedOnesAreNot) {
  const LensCamera lens{CameraModel::kPinhole, 1297, 840, {1000, 1000, 648.5, 420}};
  EXPECT_EQ(ScaledLens(lens, 1297, 840)->params, lens.params);
  for (const auto& [width, height] : {std::pair{648, 420}, {649, 420}, {324, 210}, {324, 209}}) {
    EXPECT_TRUE(ScaledLens(lens, width, height)) << width << " x " << height;
  }
  for (const auto& [width, height] :
       {std::pair{840, 1297}, {1297, 800}, {640, 420}, {648, 480}, {324, 213}}) {
    EXPECT_FALSE(ScaledLens(lens, width, height)) << width << " x " << height;
  }
}

}  // namespace
}  // namespace dtr::calib
