#include "calib/undistort.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "dtr/types/area_average.h"
#include "tests/calib/lens_models.h"
#include "tests/support/on_threads.h"

namespace dtr::calib {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 150;
// Rounding to 8 bits happens twice (photo, result), half a level each, and the kernel exaggerates
// the finest pattern used, 8 pixels per period, by up to 0.7 % of its amplitude of 120: 1.84 in all
// (worst found 1.83).
constexpr double kIntensity = 2.5;

const LensCamera kBarrel{CameraModel::kRadial, kWidth, kHeight, {kFocal, 83, 58, -0.12, 0.02}};
const LensCamera kPincushion{
    CameraModel::kOpenCv, kWidth, kHeight, {kFocal, 152, 83, 58, 0.15, 0.02, 1e-3, -2e-3}};
const LensCamera kFisheye{
    CameraModel::kOpenCvFisheye, kWidth, kHeight, {kFocal, kFocal, 83, 58, 0.03, 0, 0, 0}};

// A scene at infinity: its brightness in 0..255 by direction, with patterns of at least 8 pixels
// per period at the focal length used.
double Brightness(const Eigen::Vector3d& ray, int channel) {
  const double x = ray.x() / ray.z() * kFocal, y = ray.y() / ray.z() * kFocal;
  const double period = 8 + 3 * channel;
  return 127.5 + 60 * std::sin(2 * std::numbers::pi * x / period + channel) +
         60 * std::cos(2 * std::numbers::pi * y / (period + 2));
}

ImageRgb8 PhotoOf(const LensCamera& lens) {
  const LensMap map(lens);
  ImageRgb8 photo(lens.width_px, lens.height_px, 3);
  for (int y = 0; y < lens.height_px; ++y) {
    for (int x = 0; x < lens.width_px; ++x) {
      const auto ray = map.RayFromPixel({x + 0.5, y + 0.5});
      if (!ray || !(ray->z() > 0)) continue;
      for (int c = 0; c < 3; ++c) {
        photo(x, y, c) = static_cast<std::uint8_t>(std::lround(Brightness(*ray, c)));
      }
    }
  }
  return photo;
}

// Largest difference to the scene over usable pixels, `margin` pixels away from masked ones and
// borders, if the image's grid were off by `slip` pixels along x.
double WorstDifference(const UndistortedPhoto& photo, double slip, int margin) {
  double worst = 0;
  for (int y = margin; y < photo.image.height() - margin; ++y) {
    for (int x = margin; x < photo.image.width() - margin; ++x) {
      bool usable = true;
      for (int j = -margin; j <= margin && !photo.mask.empty(); ++j) {
        for (int i = -margin; i <= margin; ++i) usable = usable && photo.mask(x + i, y + j) != 0;
      }
      if (!usable) continue;
      const Eigen::Vector3d ray = photo.camera.RayFromPixel({x + 0.5 + slip, y + 0.5});
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(photo.image(x, y, c) - Brightness(ray, c)));
      }
    }
  }
  return worst;
}

TEST(Undistort, GivesBackTheSceneThatTheLensDistorted) {
  constexpr int kMargin = 4;  // the kernel repeats the photo's border there
  for (const LensCamera& lens : {kBarrel, kPincushion, kFisheye}) {
    const UndistortedPhoto photo = Undistort(PhotoOf(lens), lens, 0);
    EXPECT_EQ(photo.camera, lens.Pinhole());
    EXPECT_LT(WorstDifference(photo, 0, kMargin), kIntensity) << NameOf(lens.model);
    // The control: a slip of half a pixel must be far outside that limit.
    EXPECT_GT(WorstDifference(photo, 0.5, kMargin), 8 * kIntensity) << NameOf(lens.model);
    EXPECT_GT(WorstDifference(photo, 0.1, kMargin), kIntensity) << NameOf(lens.model);
  }
}

TEST(Undistort, DrawsOntoACameraWhosePrincipalPointLiesElsewhere) {
  for (const LensCamera& lens : {kBarrel, kFisheye}) {
    const PinholeCamera onto(kWidth, kHeight, kFocal, kFocal, 80.25, 60.5);
    const UndistortedPhoto photo = Undistort(PhotoOf(lens), {}, lens, onto, 0);
    EXPECT_EQ(photo.camera, onto);
    EXPECT_LT(WorstDifference(photo, 0, 4), kIntensity) << NameOf(lens.model);
    EXPECT_GT(WorstDifference(photo, 0.1, 4), kIntensity) << NameOf(lens.model);
  }
  EXPECT_THROW(Undistort(PhotoOf(kBarrel), {}, kBarrel, PinholeCamera(8, 8, 9, 9, 4, 4), 0),
               std::invalid_argument);
}

TEST(Undistort, MaskTellsExactlyWhichPixelsTheLensSaw) {
  for (const LensCamera& lens : {kBarrel, kPincushion, kFisheye}) {
    const UndistortedPhoto photo = Undistort(PhotoOf(lens), lens, 0);
    const PinholeCamera photo_area = lens.Pinhole();
    int missing = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto source = lens.PixelFromCam(photo.camera.RayFromPixel({x + 0.5, y + 0.5}));
        const bool seen = source && photo_area.Contains(*source);
        missing += !seen;
        if (!photo.mask.empty()) {
          ASSERT_EQ(photo.mask(x, y), seen ? 255 : 0);
        }
        if (!seen) {
          ASSERT_EQ(photo.image(x, y, 1), 0);
        }
      }
    }
    EXPECT_EQ(photo.mask.empty(), missing == 0);
    // Barrel images of the whole view squeeze more in than the pinhole shows: every pixel has a
    // source. Pincushion images end before the pinhole's corners.
    EXPECT_EQ(missing > 0, lens.model == CameraModel::kOpenCv)
        << NameOf(lens.model) << " " << missing;
  }
}

TEST(Undistort, CornersOfAPincushionPhotoAreMaskedAndItsCentreIsNot) {
  const UndistortedPhoto photo = Undistort(PhotoOf(kPincushion), kPincushion, 0);
  ASSERT_FALSE(photo.mask.empty());
  for (const int y : {0, kHeight - 1}) {
    for (const int x : {0, kWidth - 1}) EXPECT_EQ(photo.mask(x, y), 0);
  }
  EXPECT_EQ(photo.mask(kWidth / 2, kHeight / 2), 255);
}

TEST(Undistort, WhatMayNotBeUsedIsMaskedWhereTheLensShowsIt) {
  for (const LensCamera& lens :
       {kBarrel, kPincushion,
        LensCamera{CameraModel::kPinhole, kWidth, kHeight, {kFocal, kFocal, 83, 58}}}) {
    Mask usable(kWidth, kHeight, 1, 255);
    for (int y = 30; y < 60; ++y) {
      for (int x = 20; x < 50; ++x) usable(x, y) = 0;
    }
    const UndistortedPhoto photo = Undistort(PhotoOf(lens), usable, lens, 0);
    const UndistortedPhoto whole = Undistort(PhotoOf(lens), lens, 0);
    ASSERT_FALSE(photo.mask.empty());
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto source = lens.PixelFromCam(photo.camera.RayFromPixel({x + 0.5, y + 0.5}));
        const bool inside = source && source->x() >= 20 && source->x() < 50 && source->y() >= 30 &&
                            source->y() < 60;
        const bool near =
            source && source->x() > 19 && source->x() < 51 && source->y() > 29 && source->y() < 61;
        if (inside) {
          ASSERT_EQ(photo.mask(x, y), 0) << x << " " << y;
          ASSERT_EQ(photo.image(x, y, 0), 0);
        } else if (!near) {
          ASSERT_EQ(photo.mask(x, y), whole.mask.empty() ? 255 : whole.mask(x, y));
          ASSERT_EQ(photo.image(x, y, 1), whole.image(x, y, 1));
        }
      }
    }
    const UndistortedPhoto all = Undistort(PhotoOf(lens), Mask(kWidth, kHeight, 1, 255), lens, 0);
    EXPECT_EQ(all.mask, whole.mask);
    EXPECT_EQ(all.image, whole.image);
  }
  EXPECT_THROW(Undistort(PhotoOf(kBarrel), Mask(8, 8, 1, 255), kBarrel, 0), std::invalid_argument);
}

TEST(Undistort, RaysBeyondTheModelsReachAreMasked) {
  // The distortion turns back at r = 0.58, inside the image: nothing beyond may be shown.
  const LensCamera lens{CameraModel::kSimpleRadial, kWidth, kHeight, {60, 80, 60, -1.0}};
  const UndistortedPhoto photo = Undistort(ImageRgb8(kWidth, kHeight, 3, 200), lens, 0);
  ASSERT_FALSE(photo.mask.empty());
  EXPECT_EQ(photo.mask(80, 60), 255);
  EXPECT_EQ(photo.mask(80 + 33, 60), 255);  // r = 33.5 / 60
  EXPECT_EQ(photo.mask(80 + 36, 60), 0);    // r = 36.5 / 60
}

TEST(Undistort, PhotosWithoutDistortionKeepTheirBytes) {
  Random random(8);
  ImageRgb8 photo(kWidth, kHeight, 3);
  for (auto& value : photo.data()) value = static_cast<std::uint8_t>(random.Index(256));
  const LensCamera lens{CameraModel::kOpenCv, kWidth, kHeight, {150, 150, 80, 60, 0, 0, 0, 0}};
  const UndistortedPhoto same = Undistort(photo, lens, 0);
  EXPECT_EQ(same.image, photo);
  EXPECT_TRUE(same.mask.empty());
  const UndistortedPhoto half = Undistort(photo, lens, 80);
  EXPECT_EQ(half.image, AreaAverage(photo, 80, 60));
  EXPECT_EQ(half.camera, PinholeCamera(80, 60, 75, 75, 40, 30));
}

TEST(Undistort, ShrinkingKeepsTheGridOverTheScene) {
  // Area averages soften a pattern; compare with the same averages of the scene, 8x8 samples each.
  for (const LensCamera& lens : {kBarrel, kFisheye}) {
    const UndistortedPhoto photo = Undistort(PhotoOf(lens), lens, 100);
    ASSERT_EQ(photo.image.width(), 100);
    ASSERT_EQ(photo.image.height(), 75);
    EXPECT_EQ(photo.camera, lens.Pinhole().Resized(100, 75));
    double worst = 0;
    for (int y = 4; y < 71; ++y) {
      for (int x = 4; x < 96; ++x) {
        double mean = 0;
        for (int s = 0; s < 64; ++s) {
          const Eigen::Vector2d pixel(x + (s % 8 + 0.5) / 8, y + (s / 8 + 0.5) / 8);
          mean += Brightness(photo.camera.RayFromPixel(pixel), 0) / 64;
        }
        worst = std::max(worst, std::abs(photo.image(x, y, 0) - mean));
      }
    }
    // The full-size grid's own pixels are samples, not means: a box of 1.6 of them differs from
    // the true mean by up to 5 % of an amplitude of 120 at 8 pixels per period.
    EXPECT_LT(worst, 7) << NameOf(lens.model);
  }
}

TEST(Undistort, ShrunkMaskCoversEveryPixelThatTouchesAMissingOne) {
  const ImageRgb8 distorted = PhotoOf(kPincushion);
  const UndistortedPhoto full = Undistort(distorted, kPincushion, 0);
  const UndistortedPhoto small = Undistort(distorted, kPincushion, 50);
  EXPECT_EQ(small.mask, ShrinkMask(full.mask, 50, 38));
  for (int y = 0; y < 38; ++y) {
    for (int x = 0; x < 50; ++x) {
      if (small.mask(x, y) == 0) {
        ASSERT_EQ(small.image(x, y, 0), 0);
      }
    }
  }
}

TEST(Undistort, SameBytesForAnyNumberOfThreads) {
  const ImageRgb8 distorted = PhotoOf(kPincushion);
  const UndistortedPhoto one = OnThreads(1, [&] { return Undistort(distorted, kPincushion, 97); });
  for (const int threads : {2, 5}) {
    const UndistortedPhoto more =
        OnThreads(threads, [&] { return Undistort(distorted, kPincushion, 97); });
    EXPECT_EQ(more.image, one.image);
    EXPECT_EQ(more.mask, one.mask);
  }
}

TEST(Undistort, RejectsAPhotoOfAnotherSize) {
  EXPECT_THROW(Undistort(ImageRgb8(kHeight, kWidth, 3), kBarrel, 0), Error);
}

TEST(UndistortedPixel, InvertsWhatUndistortionDid) {
  Random random(9);
  for (const LensCamera& lens : {kBarrel, kPincushion, kFisheye}) {
    const PinholeCamera shrunk = lens.Pinhole().Resized(80, 60);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector2d pixel(random.Uniform(0, kWidth), random.Uniform(0, kHeight));
      const auto undistorted = UndistortedPixel(lens, shrunk, pixel);
      ASSERT_TRUE(undistorted);
      const auto back = lens.PixelFromCam(shrunk.RayFromPixel(*undistorted));
      ASSERT_TRUE(back);
      ASSERT_LT((*back - pixel).norm(), 1e-9);
    }
  }
  // A fisheye's ray at 100 degrees is on no pinhole image.
  const LensCamera wide{CameraModel::kOpenCvFisheye, 640, 640, {150, 150, 320, 320, 0, 0, 0, 0}};
  EXPECT_FALSE(UndistortedPixel(wide, wide.Pinhole(), {320 + 150 * 1.75, 320}));
}

}  // namespace
}  // namespace dtr::calib
