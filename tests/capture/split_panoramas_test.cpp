#include "capture/split_panoramas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture/ingest.h"
#include "capture/panorama_views.h"
#include "capture/store.h"
#include "dtr/base/error.h"
#include "dtr/io/panorama_xmp.h"
#include "tests/capture/photo_files.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::MessageOf;
using dtr::testing::TemporaryFolder;
using Eigen::Vector3d;
using ::testing::HasSubstr;

// Colours that are a smooth function of the direction alone.
Vector3d ColourOf(const Vector3d& direction) {
  const Vector3d d = direction.normalized();
  return Vector3d(128, 128, 128) + 90 * Vector3d(d.x(), d.y(), 0.6 * d.z() + 0.4 * d.x() * d.y());
}

ImageRgb8 SmoothPanorama(int width_px) {
  const Panorama panorama{static_cast<double>(width_px), width_px / 2.0, 0, 0};
  ImageRgb8 image(width_px, width_px / 2, 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const Vector3d colour = ColourOf(panorama.DirectionFromPixel({x + 0.5, y + 0.5}));
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = static_cast<std::uint8_t>(std::lround(colour[c]));
      }
    }
  }
  return image;
}

TEST(PanoramaView, ShowsTheColourOfEveryDirection) {
  constexpr double kLevels = 1.1;  // rounding of panorama and view
  const int width_px = 400;
  const ImageRgb8 image = SmoothPanorama(width_px);
  const Panorama panorama{400, 200, 0, 0};
  for (const PanoramaFace& face : PanoramaFaces()) {
    const PinholeCamera camera = FaceCamera(FaceSizePx(width_px));
    const PanoramaView view = ViewOfPanorama(image, {}, panorama, camera, face.cam_from_panorama);
    EXPECT_TRUE(view.mask.empty());
    double worst = 0;
    for (int y = 0; y < view.image.height(); ++y) {
      for (int x = 0; x < view.image.width(); ++x) {
        const Vector3d expected =
            ColourOf(face.cam_from_panorama.transpose() * camera.RayFromPixel({x + 0.5, y + 0.5}));
        for (int c = 0; c < 3; ++c) {
          worst = std::max(worst, std::abs(view.image(x, y, c) - expected[c]));
        }
      }
    }
    EXPECT_LT(worst, kLevels) << face.name;
    EXPECT_EQ(view.image,
              ViewOfPanorama(image, {}, panorama, camera, face.cam_from_panorama).image);
  }
}

TEST(PanoramaView, APartOfAPanoramaIsMaskedWhereItEnds) {
  const ImageRgb8 whole = SmoothPanorama(400);
  // The middle half in longitude, and 27 degrees up and down.
  ImageRgb8 image(200, 60, 3);
  for (int y = 0; y < 60; ++y) {
    std::copy_n(whole.row(y + 70) + 3 * 100, 3 * 200, image.row(y));
  }
  const Panorama panorama{400, 200, 100, 70};
  const PinholeCamera camera = FaceCamera(64);
  const auto front =
      ViewOfPanorama(image, {}, panorama, camera, FaceCalled("front").cam_from_panorama);
  ASSERT_FALSE(front.mask.empty());
  EXPECT_EQ(front.mask(32, 32), 255);
  // tan 27 degrees of half the size above the middle, at its column.
  EXPECT_EQ(front.mask(32, 32 - 15), 255);
  EXPECT_EQ(front.mask(32, 32 - 19), 0);
  const auto back =
      ViewOfPanorama(image, {}, panorama, camera, FaceCalled("back").cam_from_panorama);
  EXPECT_EQ(std::count(back.mask.data().begin(), back.mask.data().end(), 255), 0);
}

class SplitPanoramasTest : public ::testing::Test {
 protected:
  void WritePanorama(const std::string& name, int width_px = 256) const {
    fs::create_directories((folder_ / "in" / name).parent_path());
    io::WritePanoramaJpeg(folder_ / "in" / name, SmoothPanorama(width_px), 95);
  }
  Capture Ingested() { return IngestPhotos(folder_ / "in", {}, silent_); }
  Capture Split(PanoramaUse use = PanoramaUse::kAuto) {
    Capture capture = Ingested();
    EXPECT_TRUE(ArePanoramas(capture, use));
    return SplitPanoramas(capture, folder_ / "views", silent_);
  }
  TemporaryFolder folder_;
  SilentProgress silent_;
};

TEST_F(SplitPanoramasTest, ViewsSayPanoramaAndFaceAndHaveExactCameras) {
  WritePanorama("walk/R 1.jpg");
  WritePanorama("walk/R 2.jpg");
  const Capture views = Split();
  ASSERT_EQ(views.photos.size(), 12u);
  EXPECT_EQ(views.photos.front().name, "back/walk_R_1.jpg");
  for (const Photo& photo : views.photos) {
    ASSERT_TRUE(photo.face);
    EXPECT_THAT(photo.face->panorama, ::testing::StartsWith("walk/R "));
    EXPECT_EQ(photo.width_px, FaceSizePx(256));
    EXPECT_EQ(photo.focal_prior_px, photo.width_px / 2.0);
    EXPECT_EQ(photo.camera_group, views.photos.front().camera_group);
    const ImageRgb8 image = ReadPhoto(photo);
    const Vector3d expected =
        ColourOf(FaceCalled(photo.face->face).cam_from_panorama.transpose() * Vector3d::UnitZ());
    EXPECT_NEAR(image(image.width() / 2, image.height() / 2, 0), expected[0], 3) << photo.name;
  }
  // A capture on disk keeps what they are.
  WriteCapture(views, folder_ / "capture");
  const Capture again = ReadCapture(folder_ / "capture");
  ASSERT_EQ(again.photos.size(), 12u);
  EXPECT_EQ(again.photos[5].face->panorama, views.photos[5].face->panorama);
  EXPECT_EQ(again.photos[5].face->face, views.photos[5].face->face);
}

TEST_F(SplitPanoramasTest, MasksAreSplitAndAViewWithoutAnythingIsLeftOut) {
  WritePanorama("a.jpg");
  WritePanorama("b.jpg");
  // All below 30 degrees under the horizon: the down view is gone, those around lose their lower
  // part.
  Mask mask(256, 128, 1, 255);
  for (int y = 128 * 120 / 180; y < 128; ++y) std::fill_n(mask.row(y), 256, std::uint8_t{0});
  io::WriteMask(folder_ / "in/a_mask.png", mask);
  const Capture views = Split();
  ASSERT_EQ(views.photos.size(), 11u);
  ASSERT_EQ(views.skipped.size(), 1u);
  EXPECT_EQ(views.skipped.front().name, "down/a.jpg");
  for (const Photo& photo : views.photos) {
    EXPECT_EQ(photo.HasMask(), photo.face->panorama == "a.jpg" && photo.face->face != "up")
        << photo.name;
  }
  const Photo& front = *std::find_if(views.photos.begin(), views.photos.end(),
                                     [](const Photo& p) { return p.name == "front/a.jpg"; });
  const Mask of_view = ReadPhotoMask(front);
  const int size = front.width_px;
  EXPECT_EQ(of_view(size / 2, size / 2), 255);
  EXPECT_EQ(of_view(size / 2, size - 2), 0);
  // 30 degrees down in the middle column: tan 30 of half the size below the middle.
  const int edge = static_cast<int>(size / 2 * (1 + std::tan(M_PI / 6)));
  EXPECT_EQ(of_view(size / 2, edge - 3), 255);
  EXPECT_EQ(of_view(size / 2, edge + 3), 0);
}

TEST_F(SplitPanoramasTest, WhatStatesNothingIsAPanoramaOnlyWhereSaid) {
  fs::create_directories(folder_ / "in");
  io::WriteImage(folder_ / "in/a.jpg", SmoothPanorama(256), 95);
  io::WriteImage(folder_ / "in/b.png", SmoothPanorama(256));
  Capture capture = Ingested();
  EXPECT_FALSE(ArePanoramas(capture, PanoramaUse::kAuto));
  ASSERT_EQ(capture.remarks.size(), 1u);
  EXPECT_THAT(capture.remarks.front().text, HasSubstr("2 photos are twice as wide as high"));
  EXPECT_EQ(Split(PanoramaUse::kAlways).photos.size(), 12u);
  WritePanorama("c.jpg");
  Capture never = Ingested();
  EXPECT_FALSE(ArePanoramas(never, PanoramaUse::kNever));
  EXPECT_THAT(MessageOf<Error>([&] { (void)ArePanoramas(never, PanoramaUse::kAuto); }),
              HasSubstr("c.jpg is a 360 degree panorama, b.png is none"));
}

TEST_F(SplitPanoramasTest, AFewAmongOthersAreLeftOutAndNamed) {
  fs::create_directories(folder_ / "in");
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) {
    io::WriteImage(folder_ / "in" / name, ImageRgb8(90, 60, 3, 128), 95);
  }
  WritePanorama("pano.jpg");
  Capture one = Ingested();
  EXPECT_FALSE(ArePanoramas(one, PanoramaUse::kAuto));
  EXPECT_EQ(one.photos.size(), 3u);
  EXPECT_EQ(one.contents.photos, 3);
  ASSERT_EQ(one.skipped.size(), 1u);
  EXPECT_EQ(one.skipped.front().name, "pano.jpg");
  EXPECT_THAT(one.skipped.front().reason, HasSubstr("a 360 degree panorama among ordinary photos"));
  WritePanorama("pano2.jpg");  // two of five: which are meant is not clear
  Capture mixed = Ingested();
  EXPECT_THAT(MessageOf<Error>([&] { (void)ArePanoramas(mixed, PanoramaUse::kAuto); }),
              HasSubstr("give them in two folders"));
  for (const char* name : {"p3.jpg", "p4.jpg", "p5.jpg", "p6.jpg", "p7.jpg"}) WritePanorama(name);
  Capture many = Ingested();
  EXPECT_TRUE(ArePanoramas(many, PanoramaUse::kAuto));
  EXPECT_EQ(many.photos.size(), 7u);
  EXPECT_EQ(many.skipped.size(), 3u);
}

TEST_F(SplitPanoramasTest, SizesThatAreNoPanoramasAreNamed) {
  Photo photo;
  photo.name = "p.jpg";
  photo.width_px = 300;
  photo.height_px = 200;
  EXPECT_THAT(MessageOf<Error>([&] { (void)PanoramaOf(photo); }),
              HasSubstr("p.jpg: an equirectangular panorama is twice as wide as high"));
  // A part that was shrunk to a half since.
  photo.panorama = io::PanoramaXmp{"equirectangular", 1200, 600, 600, 400, 100, 50, {}, {}, {}};
  const Panorama half = PanoramaOf(photo);
  EXPECT_DOUBLE_EQ(half.full_width_px, 600);
  EXPECT_DOUBLE_EQ(half.left_px, 50);
  photo.height_px = 150;
  EXPECT_THAT(MessageOf<Error>([&] { (void)PanoramaOf(photo); }), HasSubstr("cropped since"));
  photo.height_px = 200;
  photo.panorama->left_px = 1000;
  EXPECT_THAT(MessageOf<Error>([&] { (void)PanoramaOf(photo); }), HasSubstr("beyond the whole"));
}

}  // namespace
}  // namespace dtr::capture
