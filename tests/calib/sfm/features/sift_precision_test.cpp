// Positions, scales, orientations and descriptors against images whose truth is known.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/calib/sfm/features/blob_scene.h"

namespace dtr::sfm::testing {
namespace {

constexpr int kWidth = 320, kHeight = 240;

BlobScene Scene() { return BlobScene::Random(kWidth, kHeight, 900, 1); }

// Of positions; most is of the few features that are another extremum within a pixel. Found: 0.11.
constexpr double kRmsPx = 0.13;

const auto kSameAngle = [](double a) { return a; };

TEST(SiftPrecision, ABlobIsOneFeatureAtItsCentreWithItsSize) {
  const Eigen::Vector2d centre(40.3, 31.8);
  const double sigma = 4;
  const Grey image = BlobScene({{centre, sigma, 0.4}}).Draw(96, 64);
  SiftOptions options;
  options.max_orientations = 1;
  const Features features = Detect(image, options);
  ASSERT_EQ(features.keypoints.size(), 1u);
  const Keypoint& k = features.keypoints[0];
  constexpr double kBlobPx = 0.03;  // of the fit of a parabola; found: 0.021
  EXPECT_NEAR(k.x_px, centre.x(), kBlobPx);
  EXPECT_NEAR(k.y_px, centre.y(), kBlobPx);
  // The difference of Gaussians of s and 2^(1/3) s answers most to a blob of 2^(1/6) s; the blur
  // that the camera is taken to have is missing in the drawing.
  const double expected = std::sqrt(sigma * sigma + 0.25) / std::exp2(1.0 / 6);
  EXPECT_NEAR(k.scale_px, expected, 0.05 * expected);
}

TEST(SiftPrecision, AShiftOfPartsOfAPixelIsFound) {
  const Similarity map{0, 1, {3.3, -2.6}};
  const Features a = Detect(Scene().Draw(kWidth, kHeight));
  const Features b = Detect(Scene().Draw(kWidth, kHeight, map));
  const Repetition r = Repeat(a, b, kWidth, kHeight, 10, 1, map, kSameAngle);
  RecordProperty("rms_px", std::to_string(r.rms_px));
  ASSERT_GT(r.inside, 300);
  EXPECT_GT(r.found, 0.93 * r.inside);
  EXPECT_GT(r.oriented, 0.88 * r.inside);
  EXPECT_GT(r.nearest, 0.97 * r.oriented);
  EXPECT_LT(r.rms_px, kRmsPx);
  EXPECT_LT(r.mean_px.norm(), 0.01);
}

TEST(SiftPrecision, RotationAndScaleAreFound) {
  Similarity map{0.5, 1.3, {40, -40}};
  const Features a = Detect(Scene().Draw(kWidth, kHeight));
  const Features b = Detect(Scene().Draw(kWidth, kHeight, map));
  const Repetition r = Repeat(a, b, kWidth, kHeight, 10, map.scale, map,
                              [&](double angle) { return angle + map.angle_rad; });
  ASSERT_GT(r.inside, 150);
  EXPECT_GT(r.found, 0.85 * r.inside);
  EXPECT_GT(r.oriented, 0.78 * r.inside);
  EXPECT_GT(r.nearest, 0.95 * r.oriented);
  EXPECT_LT(r.rms_px, 1.3 * kRmsPx);
  EXPECT_LT(r.mean_px.norm(), 0.02);
}

// A pixel convention that is off by a part of a pixel in any octave shows as a mean difference.
TEST(SiftPrecision, FeaturesOfAMirroredImageAreMirrored) {
  Grey image = Scene().Draw(kWidth, kHeight);
  const Features a = Detect(image);
  Grey mirrored(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) mirrored.at(kWidth - 1 - x, y) = image.at(x, y);
  }
  const Repetition r = Repeat(
      a, Detect(mirrored), kWidth, kHeight, 10, 1,
      [](const Eigen::Vector2d& p) { return Eigen::Vector2d(kWidth - p.x(), p.y()); },
      [](double angle) { return std::numbers::pi - angle; });
  ASSERT_GT(r.inside, 300);
  EXPECT_GT(r.found, 0.93 * r.inside);
  EXPECT_GT(r.oriented, 0.88 * r.inside);
  EXPECT_LT(r.rms_px, kRmsPx);
  EXPECT_LT(r.mean_px.norm(), 0.01);
}

TEST(SiftPrecision, FeaturesOfAnImageRotatedByARightAngleAreRotated) {
  Grey image = Scene().Draw(kWidth, kHeight);
  const Features a = Detect(image);
  Grey rotated(kHeight, kWidth);  // +x becomes +y
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) rotated.at(kHeight - 1 - y, x) = image.at(x, y);
  }
  const Repetition r = Repeat(
      a, Detect(rotated), kHeight, kWidth, 10, 1,
      [](const Eigen::Vector2d& p) { return Eigen::Vector2d(kHeight - p.y(), p.x()); },
      [](double angle) { return angle + std::numbers::pi / 2; });
  ASSERT_GT(r.inside, 300);
  EXPECT_GT(r.found, 0.93 * r.inside);
  EXPECT_GT(r.nearest, 0.97 * r.oriented);
  EXPECT_LT(r.rms_px, kRmsPx);
  EXPECT_LT(r.mean_px.norm(), 0.01);
}

TEST(SiftPrecision, FeaturesOfAShrunkPhotoAreInPixelsOfThePhoto) {
  const Similarity twice{0, 2.5, {0, 0}};
  const Grey large = Scene().Draw(800, 600, twice);
  SiftOptions options;
  options.max_size_px = kWidth;
  const Features a = Detect(Scene().Draw(kWidth, kHeight)), b = Detect(large, options);
  const Repetition r = Repeat(a, b, 800, 600, 10, 2.5, twice, kSameAngle);
  ASSERT_GT(r.inside, 300);
  EXPECT_GT(r.found, 0.8 * r.inside);
  EXPECT_GT(r.nearest, 0.95 * r.oriented);
  EXPECT_LT(r.rms_px, 2.5 * kRmsPx);
  EXPECT_LT(r.mean_px.norm(), 0.025);
}

}  // namespace
}  // namespace dtr::sfm::testing
