#include "calib/sfm/run/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/calib/sfm/run/some_graph.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::sfm {
namespace {

namespace fs = std::filesystem;
using namespace testing;
using ::testing::HasSubstr;

class Store : public ::testing::Test {
 protected:
  Store() {
    WriteSomeFeatures(features_);
    WriteMatches(matches_, SomeGraph());
  }

  ViewGraph Read() const {
    return ReadMatches(matches_, FeatureFile(features_), std::vector<std::string>{"a", "b"});
  }

  // What reading says where `value` stands in the place of a number of the same size.
  template <typename T>
  std::string MessageWith(const fs::path& file, size_t offset, T value) const {
    const std::string whole = ReadFile(file, 1 << 20);
    std::string changed = whole;
    std::memcpy(changed.data() + offset, &value, sizeof value);
    WriteFileAtomically(file, changed);
    const std::string message = dtr::testing::MessageOf<Error>([&] { Read(); });
    WriteFileAtomically(file, whole);
    return message;
  }

  const dtr::testing::TemporaryFolder folder_;
  const fs::path features_ = folder_ / "features.bin", matches_ = folder_ / "matches.bin";
};

TEST_F(Store, GivesBackWhatWasWritten) {
  const ViewGraph wrote = SomeGraph(), read = Read();
  ASSERT_EQ(read.images.size(), 2u);
  EXPECT_EQ(read.images[1].name, "b");
  EXPECT_EQ(read.images[1].pixels, wrote.images[1].pixels);
  EXPECT_EQ(read.cameras[0].params, wrote.cameras[0].params);
  EXPECT_EQ(read.focal_is_known, wrote.focal_is_known);
  ASSERT_EQ(read.pairs.size(), 1u);
  EXPECT_EQ(read.pairs[0].matches, wrote.pairs[0].matches);
  EXPECT_EQ(read.pairs[0].kind, PairKind::kCalibrated);
  EXPECT_TRUE(read.pairs[0].b_rotation_a.isApprox(wrote.pairs[0].b_rotation_a, 1e-14));
  EXPECT_EQ(read.pairs[0].b_translation_a, wrote.pairs[0].b_translation_a);
  EXPECT_GT(read.pairs[0].parallax_rad, 0);

  const FeatureFile file(features_);
  const Features features = file.Of(1);
  EXPECT_EQ(features.descriptors, SomeFeatures(45).descriptors);
  EXPECT_EQ(features.keypoints[3].x_px, SomeFeatures(45).keypoints[3].x_px);
  EXPECT_EQ(features.keypoints[3].orientation_rad, SomeFeatures(45).keypoints[3].orientation_rad);
  EXPECT_EQ(file.DescriptorsOf(0, 7).size(), 7u);
  EXPECT_EQ(file.DescriptorsOf(0, 700), SomeFeatures(1).descriptors);
}

TEST_F(Store, FilesCutShortAreRejected) {
  dtr::testing::ExpectEveryPrefixIsAnError(matches_, 7, [&] { Read(); });
  dtr::testing::ExpectEveryPrefixIsAnError(features_, 101, [&] { Read(); });
}

// A kill between features and their note, or amid them.
TEST_F(Store, WhatFollowsThePhotosThatCountIsDropped) {
  const auto whole = fs::file_size(features_);
  for (const auto bytes : {whole, whole - 1}) {
    fs::resize_file(features_, bytes);
    EXPECT_EQ(FeatureFile::CutAfter(features_, 2), bytes == whole);
  }
  EXPECT_TRUE(FeatureFile::CutAfter(features_, 1));
  EXPECT_TRUE(FeatureFile(features_).Has(1));
  EXPECT_FALSE(FeatureFile(features_).Has(0));
  FeatureFile::Add(features_, std::vector<size_t>{0}, std::vector{SomeFeatures(1)});
  EXPECT_EQ(Read().pairs.size(), 1u);
}

TEST_F(Store, RecordsThatCannotBeAreRejected) {
  // After 15 bytes of features.bin: photo, count and size of the descriptors, then keypoints.
  EXPECT_THAT(MessageWith(features_, 15, std::uint64_t{0}), HasSubstr("photo 0 twice"));
  EXPECT_THAT(MessageWith(features_, 15, std::uint64_t{7}), HasSubstr("no features of photo 1"));
  EXPECT_THAT(MessageWith(features_, 23, ~std::uint64_t{0}), HasSubstr("a file cut short"));
  EXPECT_THAT(MessageWith(features_, 31, std::uint64_t{64}), HasSubstr("descriptors of 64 bytes"));
  EXPECT_THAT(MessageWith(features_, 39, std::numeric_limits<float>::infinity()),
              HasSubstr("a feature that is not finite"));
  // After 14 bytes of matches.bin: cameras (29 bytes and 5 numbers), images, then the pairs.
  EXPECT_THAT(MessageWith(matches_, 0, 'x'), HasSubstr("another file"));
  EXPECT_THAT(MessageWith(matches_, 23, 99), HasSubstr("a camera of the model 99"));
  EXPECT_THAT(MessageWith(matches_, 35, ~std::uint64_t{0}), HasSubstr("a file cut short"));
  constexpr size_t kImages = 22 + 21 + 40, kPair = kImages + 24;
  EXPECT_THAT(MessageWith(matches_, kImages, std::uint64_t{1}), HasSubstr("1 photos of 2"));
  EXPECT_THAT(MessageWith(matches_, kImages + 8, -1), HasSubstr("an image without a camera"));
  EXPECT_THAT(MessageWith(matches_, kPair, 1), HasSubstr("a pair of images that it lacks"));
  EXPECT_THAT(MessageWith(matches_, kPair + 8, 4), HasSubstr("a pair of kind 4"));
  EXPECT_THAT(MessageWith(matches_, kPair + 48, std::numeric_limits<double>::quiet_NaN()),
              HasSubstr("a number that is not finite"));
  EXPECT_THAT(MessageWith(matches_, kPair + 72, ~std::uint64_t{0}), HasSubstr("a file cut short"));
  EXPECT_THAT(MessageWith(matches_, kPair + 80, 20), HasSubstr("that its image lacks"));
  EXPECT_THAT(MessageWith(matches_, kImages + 16, std::uint64_t{0}),
              HasSubstr("more than it should hold"));
}

TEST_F(Store, AFolderThatIsNotThereIsSaidSo) {
  const fs::path file = folder_ / "absent" / "x.bin";
  EXPECT_THAT(dtr::testing::MessageOf<Error>([&] { FeatureFile::Create(file); }),
              HasSubstr("absent"));
  EXPECT_THAT(dtr::testing::MessageOf<Error>([&] { WriteMatches(file, SomeGraph()); }),
              HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace dtr::sfm
