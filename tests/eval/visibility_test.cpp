#include "dtr/eval/visibility.h"

#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/eval/plane_views.h"

namespace dtr::eval {
namespace {

using testing::PlaneView;

TrueView Borrow(const View& view) { return {view.camera, view.cam_from_world, &view.depth}; }

TEST(Visibility, EverythingIsSeenFromTheSamePlace) {
  const View view = PlaneView(0, 0.1, true);
  const TrueView itself = Borrow(view);
  const auto count = CountSeenBy(itself, {&itself, 1});
  for (const std::uint8_t n : count.data()) ASSERT_EQ(n, 1);
}

TEST(Visibility, WhatTheSquareHidesIsNotSeen) {
  const View left = PlaneView(-4, 0, true), right = PlaneView(1, 0, true);
  // The plane point straight behind the square for the right camera, beside it for the left one.
  const Eigen::Vector3d square(0, 0, 6);
  const double t = testing::CastRay({1, 0, 0}, Eigen::Vector3d(-1, 0, 6) / 6, false);
  const Eigen::Vector3d hidden = Eigen::Vector3d(1, 0, 0) + t * Eigen::Vector3d(-1, 0, 6) / 6;
  EXPECT_TRUE(Sees(Borrow(right), square));
  EXPECT_FALSE(Sees(Borrow(right), hidden));
  EXPECT_TRUE(Sees(Borrow(left), hidden));
  EXPECT_FALSE(Sees(Borrow(left), {0, 0, -5}));    // behind the camera
  EXPECT_FALSE(Sees(Borrow(left), {100, 0, 30}));  // off the image
}

TEST(Visibility, AgreesWithRaysCastFromTheOtherSide) {
  const View novel = PlaneView(0.3, 0.05, true), source = PlaneView(-0.8, -0.04, true);
  const TrueView other = Borrow(source);
  const auto count = CountSeenBy(Borrow(novel), {&other, 1});
  const Pose world_from_novel = novel.cam_from_world.Inverse();
  int wrong = 0, seen = 0;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      const Eigen::Vector3d p =
          world_from_novel *
          novel.camera.CamFromPixel({x + 0.5, y + 0.5}, novel.depth(x, y), DepthKind::kPlaneZ);
      const auto pixel = source.camera.PixelFromCam(source.cam_from_world * p);
      bool truly = pixel && source.camera.Contains(*pixel);
      if (truly) {
        const Eigen::Vector3d center = source.CenterInWorld();
        truly = testing::CastRay(center, p - center, true) > 1 - 1e-6;
      }
      seen += truly;
      wrong += truly != (count(x, y) == 1);
    }
  }
  EXPECT_GT(seen, 3000);
  EXPECT_LE(wrong, 40);  // the outline of the square, about 2 * 20 + 2 * 20 pixels, half of them
}

TEST(VisibleCoverage, CountsOnlyWhatASourceSees) {
  const View novel = PlaneView(0, 0, true);
  const View source = PlaneView(3, 0, true);
  const TrueView other = Borrow(source);
  const auto count = CountSeenBy(Borrow(novel), {&other, 1});
  Mask coverage(80, 60);
  for (size_t i = 0; i < coverage.data().size(); ++i) {
    coverage.data()[i] = count.data()[i] != 0 ? 255 : 0;
  }
  EXPECT_LT(std::count(coverage.data().begin(), coverage.data().end(), 255), 80 * 60);
  EXPECT_DOUBLE_EQ(VisibleCoverage(Borrow(novel), {&other, 1}, coverage), 1.0);
  EXPECT_DOUBLE_EQ(VisibleCoverage(Borrow(novel), {&other, 1}, Mask(80, 60)), 0.0);
  EXPECT_DOUBLE_EQ(VisibleCoverage(Borrow(novel), {}, Mask(80, 60)), 1.0);
  EXPECT_THROW(VisibleCoverage(Borrow(novel), {&other, 1}, Mask(8, 6)), Error);
}

TEST(VisibleMask, NeedsTwoOtherViews) {
  const View a = PlaneView(0, 0, false), b = PlaneView(0.1, 0, false), c = PlaneView(0.2, 0, false);
  const std::vector<TrueView> one{Borrow(b)}, two{Borrow(b), Borrow(c)};
  EXPECT_EQ(VisibleMask(Borrow(a), one)(40, 30), 0);
  EXPECT_EQ(VisibleMask(Borrow(a), two)(40, 30), 255);
}

TEST(Visibility, DepthOfTheWrongSizeIsRejected) {
  const View view = PlaneView(0, 0, false);
  TrueView broken = Borrow(view);
  broken.depth = nullptr;
  EXPECT_THROW(CountSeenBy(broken, {}), Error);
  const DepthImage small(8, 6);
  broken.depth = &small;
  EXPECT_THROW(CountSeenBy(Borrow(view), {&broken, 1}), Error);
}

TEST(TexturedMask, HandWorkedDeviation) {
  // Left half: a checkerboard of +-3 levels (deviation 3); right half: +-5.
  ImageRgb8 image(60, 30, 3);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 60; ++x) {
      const int d = x < 30 ? 3 : 5;
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = static_cast<std::uint8_t>(100 + ((x + y) % 2 == 0 ? d : -d));
      }
    }
  }
  const Mask mask = TexturedMask(image);
  EXPECT_EQ(mask(10, 15), 0);
  EXPECT_EQ(mask(50, 15), 255);
  EXPECT_EQ(mask(0, 0), 0);
  EXPECT_EQ(mask(59, 29), 255);
  EXPECT_THROW(TexturedMask(ImageRgb8(4, 4, 1)), Error);
}

}  // namespace
}  // namespace dtr::eval
