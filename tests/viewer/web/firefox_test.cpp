// The exported page in Debian's Firefox ESR.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"
#include "tests/support/virtual_display.h"
#include "tests/viewer/web/in_browser.h"

namespace dtr::testing {
namespace {

// Of 255, mean of all pixels: the image from a photo's camera is mostly that photo's own pixels.
constexpr double kLikeThePhoto = 4;

class WebPageInFirefox : public InBrowser {
 protected:
  WebPageInFirefox() : InBrowser(kFirefox, "puppeteer-core") {}
};

TEST_F(WebPageInFirefox, ShowsTheSceneAndDoesWhatMouseAndKeysAsk) {
  const VirtualDisplay display;
  if (!display.up()) GTEST_SKIP() << "needs Xvfb";
  const std::string page = (folder_ / "page.html").string();
  DtrOk({"export", (folder_ / "set.dtr").string(), "--format", "web", "-o", page});
  const nlohmann::json found = Found({DTR_DRIVE_FIREFOX, page, kFirefox});
  EXPECT_THAT(found["messages"], ::testing::IsEmpty()) << found;
  EXPECT_EQ(found["problem"], "");
  EXPECT_GT(found["loaded"], 2);
  EXPECT_LT(found["black"], 0.001);
  EXPECT_LT(found["difference"], kLikeThePhoto);
  EXPECT_EQ(found["orbits"], true);
  EXPECT_THAT(found["photo"].get<std::string>(),
              ::testing::HasSubstr(found["next"].get<std::string>()));
  EXPECT_THAT(found["distance"].get<std::string>(), ::testing::EndsWith(" m"));
}

}  // namespace
}  // namespace dtr::testing
