// `dtr bench --stage calibration` with the real COLMAP on rendered photos.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dtr/base/process.h"
#include "tests/cli/arc_photos.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

using Json = nlohmann::json;

// A good calibration of these photos, by any run of COLMAP: what the reference tracks's own
// observations err by.
constexpr double kGoodPx = 0.6;

TEST(BenchCalibrationByColmap, SmallerFeaturesCostLessAndErrMore) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "colmap is absent";
  const TemporaryFolder folder;
  MakeArcPhotos(folder / "made");
  const std::string set = (folder / "set.dtr").string(), photos = (folder / "made/images").string();
  DtrOk({"import", "--cameras", (folder / "made/cameras.json").string(), "--images", photos,
         "--depth", (folder / "made/depth").string(), "-o", set});
  const auto point = [&](const std::string& setting) {
    const Json json = Json::parse(
        DtrOk({"bench", set, "--renderer", "cpu", "--stage", "calibration", "--photos", photos,
               "--point", setting, "-o", (folder / "out").string(), "--json", "-"})
            .out);
    return json["stages"][0]["points"][0];
  };
  const Json usual = point("sfm=colmap"), small = point("sfm=colmap,feature-size=240");
  EXPECT_EQ(usual["figures"]["not_registered"], 0);
  EXPECT_LT(usual["figures"]["median_px"], kGoodPx);
  EXPECT_LT(small["cost"], 0.9 * usual["cost"].get<double>());
  EXPECT_GT(small["error"], usual["error"]);
  EXPECT_EQ(point("sfm=colmap")["error"], usual["error"]) << "COLMAP's model is kept";
  const Json own = point("default");
  EXPECT_EQ(own["figures"]["not_registered"], 0);
  EXPECT_LT(own["error"], 1.05 * usual["error"].get<double>());
}

}  // namespace
}  // namespace dtr::testing
