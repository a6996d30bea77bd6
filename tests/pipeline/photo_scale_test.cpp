// Models whose photos were scaled since they were made.
#include "pipeline/core/cameras/photo_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/scaled_lens.h"

namespace dtr::pipeline {
namespace {

using ::testing::HasSubstr;

constexpr double kSameScaledPx = 1e-9;

calib::LensCamera Radial(int width_px, int height_px) {
  return {calib::CameraModel::kSimpleRadial,
          width_px,
          height_px,
          {0.9 * width_px, 0.5 * width_px + 7, 0.5 * height_px - 3, -0.08}};
}

calib::SfmModel ModelOf(const calib::LensCamera& camera) {
  calib::SfmModel model;
  model.cameras[4] = camera;
  model.images = {{1, "a.jpg", 4, {}, {{{100, 60}, 9}}}, {2, "b.jpg", 4, {}, {}}};
  model.points[9] = {};
  return model;
}

std::string Scaled(const StoredSize& a, const StoredSize& b, calib::SfmModel& model) {
  return ScaleToPhotos({{"a.jpg", a}, {"b.jpg", b}}, PhotoGrid::kStored, "sparse/0", model);
}

// A point is seen at the scaled pixel, whatever the lens.
TEST(ScaledTo, PixelsAreScaledByAxis) {
  const Eigen::Vector3d p(0.3, -0.2, 1);
  const std::vector<calib::LensCamera> cameras = {
      Radial(1001, 601),
      {calib::CameraModel::kOpenCvFisheye, 1001, 601, {500, 510, 480, 310, 0.1, -0.02, 0, 0}},
      {calib::CameraModel::kBrownAffine,
       1001,
       601,
       {800, 790, 480, 310, -0.1, 0.02, 0, 0, 0, 0, 1e-3, 2e-3, 0, 0, 1.5}}};
  for (const calib::LensCamera& camera : cameras) {
    for (const auto& [width, height] : {std::pair{500, 300}, {501, 300}, {2002, 1202}}) {
      const auto scaled = calib::ScaledTo(camera, width, height).PixelFromCam(p);
      const auto full = camera.PixelFromCam(p);
      ASSERT_TRUE(scaled && full);
      EXPECT_NEAR(scaled->x(), full->x() * width / 1001, kSameScaledPx) << NameOf(camera.model);
      EXPECT_NEAR(scaled->y(), full->y() * height / 601, kSameScaledPx);
    }
  }
}

TEST(ScaleToPhotos, SizesThatRoundingMadeAreScaled) {
  // Those of images_2, images_4 and images_8 of 4946x3286, rounded up or down, and a larger one.
  for (const auto& [width, height] :
       {std::pair{2473, 1643}, {1237, 822}, {1236, 821}, {618, 411}, {619, 410}, {9892, 6572}}) {
    calib::SfmModel model = ModelOf(Radial(4946, 3286));
    const std::string line = Scaled({width, height}, {width, height}, model);
    EXPECT_THAT(line, HasSubstr("sparse/0: its cameras are of images of 4946x3286, a.jpg has"));
    EXPECT_THAT(line, HasSubstr("(2 of 2 images)"));
    ASSERT_EQ(model.cameras.size(), 1u);
    const calib::LensCamera& camera = model.cameras.at(model.images[1].camera_id);
    EXPECT_EQ(camera.width_px, width);
    EXPECT_EQ(camera.height_px, height);
    EXPECT_NEAR(model.images[0].features[0].pixel.x(), 100.0 * width / 4946, kSameScaledPx);
    EXPECT_NEAR(model.images[0].features[0].pixel.y(), 60.0 * height / 3286, kSameScaledPx);
  }
}

TEST(ScaleToPhotos, OtherShapesAndNearlyTheSameSizeStay) {
  for (const auto& [width, height] : {std::pair{4000, 3000},
                                      {2000, 1504},
                                      {3985, 2989},
                                      {3999, 3000},
                                      {3000, 4000},
                                      {1000, 1000}}) {
    calib::SfmModel model = ModelOf(Radial(4000, 3000));
    EXPECT_EQ(Scaled({width, height}, {width, height}, model), "") << width << "x" << height;
    EXPECT_EQ(model.images[0].camera_id, 4u);
  }
}

TEST(ScaleToPhotos, PhotosOfOneCameraMayHaveSizesOfTheirOwn) {
  calib::SfmModel model = ModelOf(Radial(4000, 3000));
  EXPECT_THAT(Scaled({2000, 1500}, {4000, 3000}, model), HasSubstr("(1 of 2 images)"));
  EXPECT_EQ(model.cameras.at(model.images[0].camera_id).width_px, 2000);
  EXPECT_EQ(model.images[1].camera_id, 4u);
}

TEST(ScaleToPhotos, PhotosWithAnExifOrientationAreScaledOnTheGridOfTheModel) {
  constexpr int kSideways = 6;
  calib::SfmModel stored = ModelOf(Radial(4000, 3000));
  Scaled({2000, 1500, kSideways}, {2000, 1500, kSideways}, stored);
  EXPECT_EQ(stored.cameras.at(stored.images[0].camera_id).width_px, 2000);
  calib::SfmModel upright = ModelOf(Radial(3000, 4000));
  Scaled({2000, 1500, kSideways}, {2000, 1500, kSideways}, upright);
  EXPECT_EQ(upright.cameras.at(upright.images[0].camera_id).width_px, 1500);
}

}  // namespace
}  // namespace dtr::pipeline
