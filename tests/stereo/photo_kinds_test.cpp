// Depth from photos as files come: grey, of 16 bits, with an alpha channel.
#include <gtest/gtest.h>

#include "datasets/exact/stereo_quality.h"
#include "dtr/io/image_io.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::stereo {
namespace {

namespace fs = std::filesystem;
using testing::Facing;
using testing::Shot;

TEST(PhotoKinds, GreySixteenBitAndAlphaPhotosGiveTheDepthOfEightBitColour) {
  const PinholeCamera camera(96, 72, 84, 84, 48, 36);
  std::vector<Shot> shots =
      testing::ShotsOf(testing::Slanted(), camera, {Facing({0, 0, 0}), Facing({0.4, 0, 0})});
  const auto estimate = [&] {
    return testing::EstimateFirstBy("patchmatch", testing::ViewsOf(shots), {2.5, 8});
  };
  const DepthEstimate expected = estimate();
  const std::vector<Shot> originals = shots;
  const dtr::testing::TemporaryFolder folder;
  // What the rig photographs is grey: one channel says it all.
  for (const auto& write :
       {dtr::testing::WriteGrey, dtr::testing::WriteSixteenBits, dtr::testing::WriteAlpha}) {
    for (size_t i = 0; i < shots.size(); ++i) {
      const fs::path file = folder / (std::to_string(i) + ".png");
      write(file, originals[i].image);
      shots[i].image = io::ReadImage(file);
    }
    const DepthEstimate found = estimate();
    EXPECT_EQ(found.depth, expected.depth);
    EXPECT_EQ(found.inverse_depth_sigma, expected.inverse_depth_sigma);
  }
}

}  // namespace
}  // namespace dtr::stereo
