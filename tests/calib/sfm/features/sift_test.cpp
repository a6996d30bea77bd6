#include "calib/sfm/features/sift.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <thread>
#include <tuple>

#include "tests/calib/sfm/features/blob_scene.h"
#include "tests/support/instruction_sets.h"

namespace dtr::sfm::testing {
namespace {

constexpr int kWidth = 203, kHeight = 151;

Grey Image() { return BlobScene::Random(kWidth, kHeight, 500, 7).Draw(kWidth, kHeight); }

bool SameBytes(const Features& a, const Features& b) {
  const auto same = [](const Keypoint& p, const Keypoint& q) {
    return std::memcmp(&p, &q, sizeof(p)) == 0;
  };
  return a.descriptors == b.descriptors && std::equal(a.keypoints.begin(), a.keypoints.end(),
                                                      b.keypoints.begin(), b.keypoints.end(), same);
}

TEST(Sift, EveryInstructionSetGivesTheSameBytes) {
  const Grey image = Image();
  const Features expected = Detect(image);
  ASSERT_GT(expected.keypoints.size(), 200u);
  int sets = 0;
  dtr::testing::WithEachInstructionSet([&](std::int64_t) {
    EXPECT_TRUE(SameBytes(Detect(image), expected)) << SiftInstructionSet();
    ++sets;
  });
  EXPECT_GE(sets, 1);
}

TEST(Sift, ThreadsGiveTheSameBytes) {
  const Grey image = Image();
  std::array<Features, 3> found;
  {
    std::vector<std::jthread> threads;
    for (Features& f : found) threads.emplace_back([&] { f = Detect(image); });
  }
  EXPECT_TRUE(SameBytes(found[0], found[1]));
  EXPECT_TRUE(SameBytes(found[0], found[2]));
}

TEST(Sift, BytesAndFloatsOfTheSameValuesGiveTheSameFeatures) {
  const Grey image = Image();
  std::vector<std::uint8_t> bytes;
  Grey rounded(kWidth, kHeight);
  for (size_t i = 0; i < image.values.size(); ++i) {
    bytes.push_back(static_cast<std::uint8_t>(255 * image.values[i] + 0.5f));
    rounded.values[i] = static_cast<float>(bytes[i]) * (1.0f / 255);
  }
  EXPECT_TRUE(SameBytes(
      DetectSift(std::span<const std::uint8_t>(bytes), kWidth, kHeight, {}, SiftOptions()),
      Detect(rounded)));
}

TEST(Sift, MaxFeaturesKeepsTheLargest) {
  const Grey image = Image();
  const Features all = Detect(image);
  SiftOptions options;
  options.max_features = 100;
  const Features few = Detect(image, options);
  ASSERT_GT(all.keypoints.size(), 150u);
  ASSERT_EQ(few.keypoints.size(), 100u);
  EXPECT_TRUE(
      std::is_sorted(all.keypoints.begin(), all.keypoints.end(),
                     [](const Keypoint& a, const Keypoint& b) { return a.scale_px > b.scale_px; }));
  const Features first{{all.keypoints.begin(), all.keypoints.begin() + 100},
                       {all.descriptors.begin(), all.descriptors.begin() + 100}};
  EXPECT_TRUE(SameBytes(few, first));
  options.max_features = 0;
  EXPECT_TRUE(Detect(image, options).keypoints.empty());
}

TEST(Sift, NoFeatureLiesWhereTheMaskIsZero) {
  const Grey image = Image();
  std::vector<std::uint8_t> mask(image.values.size(), 255);
  for (int y = 0; y < kHeight; ++y) std::fill_n(mask.begin() + y * kWidth, kWidth / 2, 0);
  const Features all = Detect(image), masked = Detect(image, {}, mask);
  const auto right = std::count_if(all.keypoints.begin(), all.keypoints.end(), [](auto& k) {
    return k.x_px >= kWidth / 2;  // whole pixels: the first column that is not masked
  });
  ASSERT_GT(right, 50);
  EXPECT_EQ(masked.keypoints.size(), static_cast<size_t>(right));
  for (const Keypoint& k : masked.keypoints) EXPECT_GE(k.x_px, kWidth / 2);
  EXPECT_TRUE(Detect(image, {}, std::vector<std::uint8_t>(mask.size(), 0)).keypoints.empty());
}

TEST(Sift, FlatAndTinyImagesHaveNoFeatures) {
  for (const auto& [w, h] : {std::pair(1, 1), {7, 7}, {1, 3000}, {3000, 1}, {8, 8}, {64, 64}}) {
    for (const float value : {0.0f, 0.5f, 1.0f}) {
      EXPECT_TRUE(Detect(Grey(w, h, value)).keypoints.empty()) << w << " x " << h;
    }
  }
}

TEST(Sift, SmallNoisyImagesOfAnyShapeAreRead) {
  Random random(3);
  size_t found = 0;
  for (int w = 8; w < 90; w += 9) {
    for (int h = 8; h < 90; h += 7) {
      Grey image(w, h);
      for (float& v : image.values) v = static_cast<float>(random.Index(256)) / 255;
      for (const Keypoint& k : Detect(image).keypoints) {
        EXPECT_TRUE(k.x_px >= 0 && k.y_px >= 0 && k.x_px <= w && k.y_px <= h && k.scale_px > 0);
        ++found;
      }
    }
  }
  EXPECT_GT(found, 500u);
}

TEST(Sift, ValuesThatAreNoneCountAsTheNearest) {
  Grey image = Image(), clean = image;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::array<std::pair<float, float>, 5> values{
      {{std::nanf(""), 0.0f}, {kInfinity, 1.0f}, {-kInfinity, 0.0f}, {3e38f, 1.0f}, {-2.0f, 0.0f}}};
  for (size_t i = 0; i < image.values.size(); i += 97) {
    std::tie(image.values[i], clean.values[i]) = values[i % values.size()];
  }
  EXPECT_TRUE(SameBytes(Detect(image), Detect(clean)));
}

TEST(Sift, SizesThatDoNotMatchAreRejected) {
  const std::vector<float> values(100 * 100, 0.5f);
  const std::vector<std::uint8_t> mask(99 * 100, 255);
  const std::span<const float> grey(values);
  EXPECT_THROW(DetectSift(grey, 100, 99, {}, SiftOptions()), std::invalid_argument);
  EXPECT_THROW(DetectSift(grey, -100, -100, {}, SiftOptions()), std::invalid_argument);
  EXPECT_THROW(DetectSift(grey.first(0), 0, 0, {}, SiftOptions()), std::invalid_argument);
  EXPECT_THROW(DetectSift(grey, 100, 100, mask, SiftOptions()), std::invalid_argument);
  SiftOptions options;
  options.min_contrast = 0;
  EXPECT_THROW(DetectSift(grey, 100, 100, {}, options), std::invalid_argument);
}

TEST(Sift, MemoryGrowsWithThePhotoUpToTheSizeItIsShrunkTo) {
  const double pixels = 2400.0 * 1800;
  EXPECT_GT(static_cast<double>(SiftBytes(2400, 1800)), 64 * pixels);  // three levels
  EXPECT_LT(static_cast<double>(SiftBytes(2400, 1800)), 110 * pixels);
  EXPECT_LT(SiftBytes(1200, 900), SiftBytes(2400, 1800));
  EXPECT_LT(SiftBytes(64000, 48000), SiftBytes(3200, 2400) + (std::size_t{2} << 20));
}

}  // namespace
}  // namespace dtr::sfm::testing
