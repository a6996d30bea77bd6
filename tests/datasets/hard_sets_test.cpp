#include "datasets/hard/hard_sets.h"

#include <gtest/gtest.h>

#include <set>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/cameras_json.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::datasets {
namespace {

TEST(HardSets, HaveNamesOfTheirOwnAndPhotos) {
  std::set<std::string> names;
  for (const HardSet& set : HardSets()) {
    EXPECT_TRUE(names.insert(set.name).second) << set.name;
    EXPECT_FALSE(set.what.empty());
    EXPECT_GE(set.photos.size(), 2u) << set.name;
  }
  EXPECT_GE(names.size(), 20u);
}

TEST(HardSets, PhotosAndCamerasDoNotDependOnThreads) {
  const dtr::testing::TemporaryFolder folder;
  HardSet small;
  for (const HardSet& set : HardSets()) {
    if (set.name == "blur_dark") small = set;
  }
  ASSERT_GT(small.photos.size(), 3u);
  small.photos.erase(small.photos.begin(), small.photos.begin() + 2);  // the first is blurred
  small.photos.resize(2);
  small.photos[1].exif_factor = 1.6;
  for (HardPhoto& photo : small.photos) photo.width_px = photo.height_px = 64;
  OnThreads(1, [&] { return WriteHardSet(small, folder / "a"); });
  OnThreads(2, [&] { return WriteHardSet(small, folder / "b"); });
  constexpr std::uintmax_t kLargest = 1 << 20;
  for (const char* file : {"photos/0000.jpg", "photos/0001.jpg", "cameras.json"}) {
    EXPECT_EQ(ReadFile(folder / "a" / file, kLargest), ReadFile(folder / "b" / file, kLargest));
  }
  const auto cameras = io::ReadCamerasJson(folder / "a" / "cameras.json").cameras;
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[1].name, "0001.jpg");
  EXPECT_NEAR(cameras[1].camera.fx_px(), 28.0 / 36 * 64, 1e-9);  // not what EXIF says
  EXPECT_LT(
      cameras[1].cam_from_world.rotation.angularDistance(small.photos[1].cam_from_world.rotation),
      1e-9);
  EXPECT_THROW(OnThreads(1, [&] { return WriteHardSet(small, folder / "a"); }), UsageError);
}

}  // namespace
}  // namespace dtr::datasets
