#include "calib/sfm/run/pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "calib/colmap/matching.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/test_data.h"

namespace dtr::sfm {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> PlazaPhotos() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator("datasets/plaza/images")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Resemblance, FallsWithTheDistanceOfTheViewpoints) {
  const auto files = PlazaPhotos();
  const auto features = [&](size_t i) { return SmallFeaturesOf(io::ReadImage(files[i])); };
  const auto first = features(0);
  EXPECT_EQ(first.rows(), kSmallFeatures);
  const int near = Resemblance(first, features(1)), far = Resemblance(first, features(15));
  EXPECT_EQ(near, Resemblance(features(1), first));
  EXPECT_GT(near, 30);
  EXPECT_GT(near, 3 * far);
}

TEST(Resemblance, BlankImagesResembleNothing) {
  const ImageRgb8 blank(100, 50, 3, std::uint8_t{128});
  const auto none = SmallFeaturesOf(blank);
  EXPECT_EQ(none.rows(), 0);
  EXPECT_EQ(Resemblance(none, none), 0);
}

TEST(PreselectPairs, KeepsTheChainAndIsTheSameForAnyNumberOfThreads) {
  auto files = PlazaPhotos();
  files.resize(5);
  const dtr::testing::TemporaryFolder folder;
  files.insert(files.begin() + 2, folder / "blank.png");
  io::WriteImage(files[2], ImageRgb8(100, 50, 3, std::uint8_t{128}));
  SilentProgress silent;
  const auto pairs = PreselectPairs(files, 1, 0, silent);
  EXPECT_EQ(pairs, PreselectPairs(files, 2, 0, silent));
  EXPECT_EQ(pairs, PreselectPairs(files, 2, 1e-3, silent));  // one photo at a time
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  const auto has = [&](size_t a, size_t b) {
    return std::find(pairs.begin(), pairs.end(), std::pair(a, b)) != pairs.end();
  };
  for (size_t i = 0; i + 1 < files.size(); ++i) EXPECT_TRUE(has(i, i + 1));
  EXPECT_TRUE(has(1, 3));   // neighbours across the blank one
  EXPECT_FALSE(has(2, 4));  // which has no other partners
  WriteFileAtomically(folder / "blank.png", "no image");
  EXPECT_THROW(PreselectPairs(files, 2, 0, silent), Error);
}

TEST(Partners, AreTheMostResemblingWhereFewAre) {
  std::vector<int> scores(40, 0);
  for (size_t i = 0; i < 30; ++i) scores[i] = i < 20 ? 30 : 10;  // 20 surely, 10 perhaps
  std::vector<size_t> expected(kNeighbours);
  std::iota(expected.begin(), expected.end(), size_t{0});
  EXPECT_EQ(Partners(scores), expected);
  scores.assign(40, 0);
  scores[7] = 1;
  EXPECT_EQ(Partners(scores), std::vector<size_t>{7});
}

TEST(Partners, OfADenseCaptureReachAsFarAsResemblanceDoes) {
  for (const size_t sure : {21, 25, 60, 250}) {
    std::vector<int> scores(300, 1);
    for (size_t i = 0; i < sure; ++i) scores[i] = static_cast<int>(1000 - i);
    const auto partners = Partners(scores);
    ASSERT_EQ(partners.size(), static_cast<size_t>(kNeighbours));
    for (size_t i = 0; i < kNearest; ++i) EXPECT_EQ(partners[i], i);
    for (size_t i = kNearest; i < partners.size(); ++i) EXPECT_GT(partners[i], partners[i - 1]);
    EXPECT_EQ(partners.back(), sure - 1);
  }
}

TEST(ResolveMatching, PreselectsBeyondTheExhaustiveLimit) {
  EXPECT_EQ(ResolveMatching(Matching::kAuto, kExhaustiveLimit), Matching::kExhaustive);
  EXPECT_EQ(ResolveMatching(Matching::kAuto, kExhaustiveLimit + 1), Matching::kPreselected);
  EXPECT_EQ(ResolveMatching(Matching::kSequential, 1000), Matching::kSequential);
}

}  // namespace
}  // namespace dtr::sfm
