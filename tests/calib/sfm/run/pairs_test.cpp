#include "calib/sfm/run/pairs.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/sfm/matching/pair_choice.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/on_threads.h"
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

// Photos of a walk around the square; those nearest to the first resemble it most.
TEST(MostResembling, FallsWithTheDistanceOfTheViewpoints) {
  auto files = PlazaPhotos();
  const dtr::testing::TemporaryFolder folder;
  files.push_back(folder / "blank.png");
  io::WriteImage(files.back(), ImageRgb8(100, 50, 3, std::uint8_t{128}));
  SilentProgress silent;
  const auto features = SmallFeaturesOf(files, 0, silent);
  EXPECT_TRUE(features.back().descriptors.empty());
  EXPECT_EQ(MostResembling(features[0], std::span(features).subspan(1)).front(), 0u);
  const auto score = [&](size_t i) {
    return matching::CoarseMatches(features[0].descriptors, features[i].descriptors).size();
  };
  EXPECT_GT(score(1), 30u);
  EXPECT_GT(score(1), 3 * score(15));
  EXPECT_EQ(MostResembling(features.back(), features).size(), 0u);
}

TEST(PreselectPairs, KeepsTheChainAndIsTheSameForAnyNumberOfThreads) {
  auto files = PlazaPhotos();
  files.resize(5);
  const dtr::testing::TemporaryFolder folder;
  files.insert(files.begin() + 2, folder / "blank.png");
  io::WriteImage(files[2], ImageRgb8(100, 50, 3, std::uint8_t{128}));
  SilentProgress silent;
  const auto preselect = [&](double memory_gb) {
    return PreselectPairs(files, {}, memory_gb, silent);
  };
  const auto pairs = OnThreads(1, [&] { return preselect(0); });
  EXPECT_EQ(pairs, OnThreads(2, [&] { return preselect(0); }));
  EXPECT_EQ(pairs, OnThreads(2, [&] { return preselect(1e-3); }));  // one photo at a time
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  const auto has = [&](size_t a, size_t b) {
    return std::find(pairs.begin(), pairs.end(), std::pair(a, b)) != pairs.end();
  };
  for (size_t i = 0; i + 1 < files.size(); ++i) EXPECT_TRUE(has(i, i + 1));
  EXPECT_TRUE(has(1, 3));   // neighbours across the blank one
  EXPECT_FALSE(has(2, 4));  // which has no other partners
  WriteFileAtomically(folder / "blank.png", "no image");
  EXPECT_THROW(preselect(0), Error);
}

TEST(ResolveMatching, PreselectsBeyondTheExhaustiveLimit) {
  EXPECT_EQ(ResolveMatching(Matching::kAuto, kExhaustiveLimit), Matching::kExhaustive);
  EXPECT_EQ(ResolveMatching(Matching::kAuto, kExhaustiveLimit + 1), Matching::kPreselected);
  EXPECT_EQ(ResolveMatching(Matching::kSequential, 1000), Matching::kSequential);
}

}  // namespace
}  // namespace dtr::sfm
