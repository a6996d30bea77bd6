// The exported page in Chromium, driven by playwright-core (npm): DTR_PLAYWRIGHT names a folder
// with its node_modules.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/base/process.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kChromium[] = "/usr/bin/chromium";
// Of the image's pixels: a dark pixel of a photo may be black.
constexpr double kBlackShare = 0.001;

class WebPage : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("DTR_PLAYWRIGHT");
    if (folder == nullptr || !fs::exists(fs::path(folder) / "node_modules/playwright-core")) {
      GTEST_SKIP() << "needs DTR_PLAYWRIGHT, a folder with playwright-core";
    }
    if (!fs::exists(kChromium)) GTEST_SKIP() << "needs Chromium";
    MakeSmallCourtyard(folder_ / "courtyard");
    ImportSmallCourtyard(folder_ / "courtyard", folder_ / "set.dtr");
    DtrOk({"export", (folder_ / "set.dtr").string(), "--format", "web", "-o", Page().string()});
  }
  fs::path Page() const { return folder_ / "page.html"; }
  nlohmann::json Driven() const {
    std::string lines, json = "{}";
    ProcessOptions options;
    options.on_line = [&](const std::string& line) {
      lines += line + "\n";
      if (line.starts_with("{\"messages\"")) json = line;
    };
    EXPECT_TRUE(RunProcess({"node", DTR_DRIVE_PAGE, Page().string(), kChromium}, options).Ok())
        << lines;
    return nlohmann::json::parse(json);
  }
  // Puts `by` over the page's bytes from `at` behind the mark on.
  void Damage(const std::string& mark, size_t at, const std::string& by) const {
    std::string page = Text(Page());
    const size_t from = page.find(mark);
    ASSERT_NE(from, std::string::npos);
    page.replace(from + mark.size() + at, by.size(), by);
    WriteFileAtomically(Page(), page);
  }

  TemporaryFolder folder_;
};

TEST_F(WebPage, ShowsTheSceneAndDoesWhatMouseKeysAndFingersAsk) {
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["messages"], IsEmpty()) << found;
  EXPECT_EQ(found["problem"], "");
  EXPECT_GT(found["loaded"], 2);
  EXPECT_LT(found["black"], kBlackShare);
  for (const char* what : {"orbits", "dollies", "flies", "oneFinger", "twoFingers"}) {
    EXPECT_EQ(found[what], true) << what;
  }
  EXPECT_THAT(found["photo"].get<std::string>(), HasSubstr("2 / "));
  EXPECT_EQ(found["compares"], "true");
  EXPECT_THAT(found["distance"].get<std::string>(), EndsWith(" m"));  // the set is metric
}

TEST_F(WebPage, OneDamagedPhotoIsNamedAndTheOthersAreShown) {
  Damage("id=\"view-1\">", 400, "AAAA");
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr("expected bytes of its checksum"));
  EXPECT_GT(found["loaded"], 1);
}

TEST_F(WebPage, APageThatIsCutShortSaysSo) {
  std::string page = Text(Page());
  page.resize(page.find("id=\"view-0\">") + 1000);
  WriteFileAtomically(Page(), page);
  EXPECT_THAT(Driven()["problem"].get<std::string>(), HasSubstr("cut short"));
}

TEST_F(WebPage, SizesThatAreNoneAreRejectedBeforeAnythingIsAllocated) {
  Damage("\"width\":", 0, "-9");
  const nlohmann::json found = Driven();
  EXPECT_THAT(found["problem"].get<std::string>(), HasSubstr("expected"));
}

}  // namespace
}  // namespace dtr::testing
