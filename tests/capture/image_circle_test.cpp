// Circles of fisheyes, and what looks a little like them.
#include "capture/image_circle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "capture/ingest.h"
#include "capture/screening.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth = 640, kHeight = 480;

/// What is seen at a pixel of photo i, 0 to 255.
using Scene = std::function<double(int photo, double x, double y)>;

/// Something like a scene: bright and dark, different in every photo.
double Texture(int photo, double x, double y) {
  return 128 + 90 * std::sin(0.02 * x + photo) * std::cos(0.03 * y - 2 * photo);
}

std::optional<ImageCircle> CircleOf(const Scene& scene, int photos = 6) {
  std::vector<Grid<std::uint16_t>> thumbnails;
  for (int i = 0; i < photos; ++i) {
    ImageRgb8 image(kWidth, kHeight, 3);
    Random noise(static_cast<std::uint64_t>(i) + 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double level = scene(i, x + 0.5, y + 0.5) + noise.Uniform(0, 4);
        for (int c = 0; c < 3; ++c) {
          image(x, y, c) = static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0));
        }
      }
    }
    thumbnails.push_back(SmallLuma(image, 64));
  }
  std::vector<const Grid<std::uint16_t>*> all;
  for (const auto& thumbnail : thumbnails) all.push_back(&thumbnail);
  return ImageCircleOf(all);
}

double FromMiddle(double x, double y, double cx = kWidth / 2, double cy = kHeight / 2) {
  return std::hypot(x - cx, y - cy);
}

TEST(ImageCircle, IsFoundWhereEveryPhotoIsBlackOutsideIt) {
  struct Case {
    double radius, cx, cy;
  };
  // Within the photo, across its sides, only in its corners; off the middle a little.
  for (const Case& c : {Case{220, 320, 240}, Case{290, 320, 240}, Case{350, 320, 240},
                        Case{230, 334, 232}, Case{300, 310, 246}}) {
    const auto circle = CircleOf([&](int i, double x, double y) {
      return FromMiddle(x, y, c.cx, c.cy) < c.radius ? Texture(i, x, y) : 0;
    });
    ASSERT_TRUE(circle) << c.radius;
    EXPECT_NEAR(10 * circle->radius, c.radius, 12) << "a pixel of the thumbnail is 10 px";
    EXPECT_LT((10 * circle->centre - Eigen::Vector2d(c.cx, c.cy)).norm(), 10);
  }
}

TEST(ImageCircle, VignettingIsNone) {
  for (const double strength : {0.5, 0.9, 1.0}) {
    EXPECT_FALSE(CircleOf([&](int i, double x, double y) {
      const double r = FromMiddle(x, y) / 400;
      return Texture(i, x, y) * (1 - strength * r * r);
    })) << strength;
  }
}

TEST(ImageCircle, ThingsBeforeBlackAreNone) {
  // A box that turns, a ball in the middle, a tall statue, a ball that wanders.
  EXPECT_FALSE(CircleOf([](int i, double x, double y) {
    const double a = 0.3 * i, u = x - 320, v = y - 240;
    const double p = std::cos(a) * u - std::sin(a) * v, q = std::sin(a) * u + std::cos(a) * v;
    return std::max(std::abs(p), std::abs(q)) < 150 ? Texture(i, x, y) : 0;
  }));
  EXPECT_FALSE(CircleOf(
      [](int i, double x, double y) { return FromMiddle(x, y) < 150 ? Texture(i, x, y) : 0; }));
  EXPECT_FALSE(CircleOf([](int i, double x, double y) {
    return std::hypot((x - 320) / 0.6, y - 240) < 220 ? Texture(i, x, y) : 0;
  }));
  EXPECT_FALSE(CircleOf([](int i, double x, double y) {
    return FromMiddle(x, y, 320 + 30 * std::cos(i), 240 + 30 * std::sin(i)) < 150 ? Texture(i, x, y)
                                                                                  : 0;
  }));
}

TEST(ImageCircle, NightAndTwoPhotosSayNothing) {
  EXPECT_FALSE(CircleOf([](int, double, double) { return 3; }));
  const auto circle = [](int i, double x, double y) {
    return FromMiddle(x, y) < 220 ? Texture(i, x, y) : 0;
  };
  EXPECT_FALSE(CircleOf(circle, 2));
  EXPECT_TRUE(CircleOf(circle, 3));
}

TEST(ImageCircle, IsNamedUnlessMasksHideTheRest) {
  std::vector<Photo> photos(4);
  for (size_t i = 0; i < photos.size(); ++i) {
    ImageRgb8 image(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (FromMiddle(x, y) >= 232) continue;
        for (int c = 0; c < 3; ++c) {
          image(x, y, c) = static_cast<std::uint8_t>(Texture(static_cast<int>(i), x, y));
        }
      }
    }
    photos[i].name = std::to_string(i) + ".jpg";
    photos[i].screening = MeasurePhoto(image);
  }
  EXPECT_THAT(LineOfImageCircle(photos),
              HasSubstr("4 photos, first 0.jpg, are black outside a circle of 7"));
  EXPECT_THAT(LineOfImageCircle(photos), HasSubstr("`lens_model` RADIAL_FISHEYE"));
  for (Photo& photo : photos) photo.mask_file = "mask.png";
  EXPECT_EQ(LineOfImageCircle(photos), "");
}

// Every folder of photos of the shared data: none of them is of a fisheye with a circle.
TEST(ImageCircleReal, NoOtherPhotosShowOne) {
  const fs::path data = testing::DataFolder();
  DTR_REQUIRE_DATA(data);
  constexpr size_t kPhotosOfAFolder = 5;
  std::map<fs::path, std::vector<fs::path>> by_folder;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    if (!entry.is_regular_file() || !IsImageExtension(entry.path().extension().string())) continue;
    by_folder[entry.path().parent_path()].push_back(entry.path());
  }
  int folders = 0;
  for (auto& [folder, files] : by_folder) {
    std::sort(files.begin(), files.end());
    std::vector<Photo> photos;
    for (const fs::path& file : files) {
      if (photos.size() == kPhotosOfAFolder) break;
      try {
        Photo photo;
        photo.name = file.filename().string();
        photo.screening.emplace().thumbnail = SmallLuma(io::ReadImage(file), 64);
        photos.push_back(std::move(photo));
      } catch (const Error&) {  // depth maps are no photos
      }
    }
    folders += photos.size() >= 3;
    EXPECT_EQ(LineOfImageCircle(photos), "") << folder;
  }
  EXPECT_GT(folders, 10);
}

}  // namespace
}  // namespace dtr::capture
