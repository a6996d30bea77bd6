// Twenty-five photos around a table (`kitchen_sparse`), of which five see little more than the
// table in common with the others.
#include <gtest/gtest.h>

#include "tests/cli/compared_with_plaza.h"

namespace dtr::testing {
namespace {

TEST(Kitchen, PhotosThatShareOnlyATableWithTheOthersGetTheirCamerasFromOurOwnMapper) {
  const auto set = DataFolder() / "kitchen_sparse";
  DTR_REQUIRE_DATA(set);
  const TemporaryFolder folder;
  const std::string output = (folder / "cal").string();
  const Ran ran = DtrOk({"calibrate", "photos", (set / "images").string(), "-o", output});
  EXPECT_EQ(ran.err.find("COLMAP's mapper"), std::string::npos) << ran.err;
  EXPECT_EQ(ran.out.find("FAILED"), std::string::npos) << ran.out;
  const calib::SfmModel model = colmap::ReadModel(output);
  EXPECT_EQ(model.images.size(), 25u);
  ASSERT_EQ(model.cameras.size(), 1u);
  // COLMAP's mapper finds 810.0 px with the same matches.
  EXPECT_NEAR(model.cameras.begin()->second.params[0], 810, 0.005 * 810);
}

}  // namespace
}  // namespace dtr::testing
