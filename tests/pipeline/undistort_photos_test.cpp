// Photos become views once: what an interrupted run wrote is neither read nor drawn again.
#include "pipeline/core/photos/undistort_photos.h"

#include <gtest/gtest.h>

#include "calib/undistort.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
constexpr int kWidthPx = 40, kHeightPx = 30, kMaxSizePx = 20;
constexpr int kPhotos = 3;

ImageRgb8 Picture(int number) {
  ImageRgb8 image(kWidthPx, kHeightPx, 3);
  for (size_t i = 0; i < image.data().size(); ++i) {
    image.data()[i] = static_cast<std::uint8_t>((i * 7 + static_cast<size_t>(number) * 50) % 251);
  }
  return image;
}

class UndistortPhotosTest : public ::testing::Test {
 protected:
  void SetUp() override {
    calibrated_.model.cameras[1] = {
        calib::CameraModel::kSimpleRadial, kWidthPx, kHeightPx, {35, 20, 15, -0.1}};
    for (int i = 0; i < kPhotos; ++i) {
      const std::string name = "p" + std::to_string(i) + ".png";
      io::WriteImage(folder_ / name, Picture(i));
      capture::Photo photo;
      photo.id = "p" + std::to_string(i);
      photo.name = name;
      photo.file = folder_ / name;
      photo.width_px = kWidthPx;
      photo.height_px = kHeightPx;
      photos_.photos.push_back(photo);
      calib::SfmImage image;
      image.id = static_cast<std::uint32_t>(i + 1);
      image.name = name;
      image.camera_id = 1;
      image.cam_from_world.translation.x() = i;
      calibrated_.model.images.push_back(image);
    }
  }

  // As a run of `dtr build` does it, which ends here without a set.
  std::vector<View> Run(const std::vector<bool>& held_out = std::vector<bool>(kPhotos, false)) {
    SilentProgress silent;
    io::SetWriter writer(folder_ / "set.dtr", "{}", false);
    std::vector<View> views =
        UndistortPhotos(photos_, calibrated_, held_out, {.max_size_px = kMaxSizePx, .memory_gb = 0},
                        writer, silent);
    for (View& view : views) {
      EXPECT_TRUE(view.image.empty()) << view.name;
      io::LoadPixels(writer.folder(), view, {});
    }
    return views;
  }

  testing::TemporaryFolder folder_;
  capture::Capture photos_;
  CalibratedPhotos calibrated_;
};

TEST_F(UndistortPhotosTest, WhatIsWrittenIsNotReadAgainByTheNextRun) {
  const std::vector<View> first = Run();
  ASSERT_EQ(first.size(), size_t{kPhotos});
  for (int i = 0; i < kPhotos; ++i) fs::remove(folder_ / photos_.photos[size_t(i)].name);
  const std::vector<View> second = Run();
  ASSERT_EQ(second.size(), first.size());
  for (size_t i = 0; i < first.size(); ++i) {
    const calib::UndistortedPhoto expected =
        calib::Undistort(Picture(static_cast<int>(i)), calibrated_.model.cameras.at(1), kMaxSizePx);
    for (const View* view : {&first[i], &second[i]}) {
      EXPECT_EQ(view->camera, expected.camera);
      EXPECT_EQ(view->image, expected.image);
      EXPECT_EQ(view->mask, expected.mask);
    }
  }
}

TEST_F(UndistortPhotosTest, AnotherCameraOrPoseOrADamagedImageIsDrawnAnew) {
  Run();
  fs::remove(folder_ / "set.dtr.partial/images/p0.png");
  calibrated_.model.images[1].cam_from_world.translation.y() = 1;
  std::vector<View> views = Run();
  EXPECT_EQ(views[0].image,
            calib::Undistort(Picture(0), calibrated_.model.cameras.at(1), kMaxSizePx).image);
  EXPECT_EQ(views[1].cam_from_world.translation.y(), 1);
  calibrated_.model.cameras[1].params[0] = 50;
  views = Run();
  EXPECT_EQ(views[2].image,
            calib::Undistort(Picture(2), calibrated_.model.cameras.at(1), kMaxSizePx).image);
  fs::remove(folder_ / "p2.png");  // all is there: not looked at
  EXPECT_NO_THROW(Run());
  calibrated_.model.cameras[1].params[0] = 51;
  EXPECT_THROW(Run(), Error);
}

TEST_F(UndistortPhotosTest, OfAStabilisedLensSourcesKeepAllTheyShowAndHeldOutPhotosShareACamera) {
  auto& cameras = calibrated_.model.cameras;
  for (std::uint32_t id = 2; id <= kPhotos; ++id) {
    cameras[id] = cameras.at(1);
    calibrated_.model.images[id - 1].camera_id = id;
  }
  cameras[2].params[1] += 1;
  cameras[3].params[2] += 1.5;
  const std::vector<View> views = Run({false, false, true});
  for (std::uint32_t id = 1; id < kPhotos; ++id) {
    EXPECT_EQ(views[id - 1].camera, calib::ShrunkCamera(cameras.at(id).Pinhole(), kMaxSizePx));
  }
  calib::LensCamera mean = cameras.at(1);
  mean.params[1] += 0.5;
  EXPECT_EQ(views[2].camera, calib::ShrunkCamera(mean.Pinhole(), kMaxSizePx));
}

}  // namespace
}  // namespace dtr::pipeline
