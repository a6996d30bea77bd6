// The exported page of a dynamic set.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"
#include "tests/viewer/web/in_browser.h"

namespace dtr::testing {
namespace {

class WebPageInTime : public InChromium {
 protected:
  void SetUp() override {
    InChromium::SetUp();
    if (IsSkipped()) return;
    std::vector<std::string> join = {"join"};
    for (const std::string time_s : {"0", "0.5"}) {
      const std::string photos = (folder_ / ("t" + time_s)).string(), set = photos + ".dtr";
      DtrOk({"dataset", "make", "sphere", "-o", photos, "--views", "4", "--width", "96", "--height",
             "64", "--time", time_s});
      DtrOk({"import", "--cameras", photos + "/cameras.json", "--images", photos + "/images",
             "--depth", photos + "/depth", "-o", set});
      join.push_back(set);
    }
    join.insert(join.end(), {"-o", (folder_ / "moving.dtr").string(), "--fps", "2"});
    DtrOk(join);
    DtrOk({"export", (folder_ / "moving.dtr").string(), "--format", "web", "-o", Page()});
  }
  std::string Page() const { return (folder_ / "page.html").string(); }
};

TEST_F(WebPageInTime, ShowsEveryTimeStepByTheSliderAndPlaysThem) {
  const nlohmann::json found = Found({DTR_DRIVE_TIME, Page(), kChromium});
  EXPECT_THAT(found["messages"], ::testing::IsEmpty()) << found;
  EXPECT_EQ(found["slider"]["hidden"], false);
  EXPECT_EQ(found["slider"]["max"], "1");
  EXPECT_GT(found["moved"], 0.01);
  EXPECT_EQ(found["again"], 0);
  EXPECT_EQ(found["playing"], "true");
}

}  // namespace
}  // namespace dtr::testing
