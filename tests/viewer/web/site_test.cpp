// The exported site and the module in it, behind a web server on this machine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "tests/cli/run_dtr.h"
#include "tests/viewer/web/in_browser.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::json;

// Colours are means of pixels that the browser drew, of 255.
constexpr double kSameColour = 1;

class WebSite : public InChromium {
 protected:
  void SetUp() override {
    InChromium::SetUp();
    if (IsSkipped()) return;
    DtrOk({"export", (folder_ / "set.dtr").string(), "--format", "web", "--no-evaluate", "-o",
           Site().string() + "/"});
  }
  fs::path Site() const { return folder_ / "site"; }
  Json Driven() const {
    return Found({DTR_DRIVE_SITE, Site().string(), kChromium, DTR_WEB_EXAMPLES});
  }
};

double Apart(const Json& a, const Json& b) {
  double worst = 0;
  for (size_t c = 0; c < 3; ++c) {
    worst = std::max(worst, std::abs(a[c].get<double>() - b[c].get<double>()));
  }
  return worst;
}

TEST_F(WebSite, StreamsTheNearestViewsFirstAndItsModuleDrawsInPagesOfOthers) {
  const Json found = Driven();
  EXPECT_THAT(found["messages"], IsEmpty()) << found;
  EXPECT_EQ(found["problem"], "");
  EXPECT_GT(found["loaded"], 2);
  EXPECT_EQ(found["order"][0], found["nearestFirst"][0]);
  EXPECT_EQ(found["order"].size(), found["loaded"]);
  for (const Json& channel : found["plain"]) EXPECT_GT(channel, 30);  // black without the scene
  if (found["three"] == false) GTEST_SKIP() << "the object of three.js: needs three";
  EXPECT_THAT(found["modelInFront"], ElementsAre(255, 0, 0));
  EXPECT_LT(Apart(found["modelBehind"], found["scene"]), kSameColour);
  EXPECT_GT(Apart(found["scene"], Json{255, 0, 0}), 50);
  // What hides what is decided where the surface is, not somewhere between.
  EXPECT_THAT(found["tenthNearer"], ElementsAre(255, 0, 0));
  EXPECT_GT(Apart(found["tenthFarther"], Json{255, 0, 0}), 50);
}

TEST_F(WebSite, AViewThatTheServerDoesNotHaveIsNamedAndTheOthersAreShown) {
  fs::remove(Site() / "view-1.bin");
  const Json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr("the server answers 404"));
  EXPECT_GT(found["loaded"], 1);
}

TEST_F(WebSite, AViewWithMoreOrOtherBytesIsNamed) {
  WriteFileAtomically(Site() / "view-1.bin", Text(Site() / "view-1.bin") + "more");
  EXPECT_THAT(Driven()["problem"].get<std::string>(), HasSubstr("bytes, found more"));
  WriteFileAtomically(Site() / "view-1.bin", "little");
  EXPECT_THAT(Driven()["problem"].get<std::string>(), HasSubstr("bytes, found 6"));
}

TEST_F(WebSite, ASetThatIsNoneIsSaidOnThePage) {
  WriteFileAtomically(Site() / "set.json", "{\"format\":");
  EXPECT_THAT(Driven()["problem"].get<std::string>(), HasSubstr("expected a JSON object"));
}

}  // namespace
}  // namespace dtr::testing
