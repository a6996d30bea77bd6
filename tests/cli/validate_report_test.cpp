// `dtr validate SET --report`: what the page tells, on a set with true cameras.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "pipeline/core/reports/residual_plots.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

size_t Times(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

class ValidateReport : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "courtyard");
    DtrOk({"build", In("courtyard/images"), "-o", In("set.dtr"), "--poses", In("courtyard/sparse"),
           "--engine", "none"});
  }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  TemporaryFolder folder_;
};

TEST_F(ValidateReport, ThePageShowsTestsViewsMapsAndTheWorstPhotos) {
  const auto before = Contents(folder_ / "set.dtr");
  const Ran ran = Dtr({"validate", In("set.dtr"), "--report", In("page.html"), "--json", "-"});
  ASSERT_TRUE(ran.code == 0 || ran.code == kFailed) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  const std::string page = Text(folder_ / "page.html");
  for (const auto& test : json["tests"]) {
    EXPECT_THAT(page, HasSubstr(test["name"].get<std::string>()));
  }
  for (const char* part :
       {"All views of 192 x 128 px together (7)", "Coverage: tested observations per cell",
        "Uncertainty: standard deviation", "Residuals by region", "The worst views"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  // Residuals, two maps, and four photos.
  EXPECT_EQ(Times(page, "data:image/svg+xml"), 7u);
  // The terminal, the page and the JSON end with the same words.
  const std::string conclusion = json["conclusion"];
  EXPECT_TRUE(ran.err.ends_with(conclusion + "\n")) << ran.err;
  EXPECT_THAT(page, HasSubstr(json["passed"] ? "validation passed" : "validation FAILED"));
  EXPECT_EQ(json["result"], json["passed"] ? "passed" : "FAILED");
  for (const auto& test : json["tests"]) {
    const std::string word = test["passed"] ? "passed " : "FAILED ";
    EXPECT_THAT(ran.err, HasSubstr(word + test["name"].get<std::string>() + ": "));
  }
  EXPECT_THAT(page, Not(HasSubstr("BROKEN")));
  // It needs no network, and the set is only read.
  EXPECT_THAT(page, Not(HasSubstr("src=\"http")));
  EXPECT_TRUE(DifferingFiles(before, Contents(folder_ / "set.dtr")).empty());
  // The same set gives the same page.
  Dtr({"validate", In("set.dtr"), "--report", In("again.html"), "--threads", "1"});
  EXPECT_EQ(page, Text(folder_ / "again.html"));
}

TEST_F(ValidateReport, DepthIsHeldAgainstTheNeighboursDepthAndItsLimitIsAnOption) {
  DtrOk({"stereo", In("set.dtr"), "--engine", "sgbm", "-o", In("deep.dtr")});
  const auto cross = [&](const nlohmann::json& tests) {
    std::map<std::string, nlohmann::json> found;
    for (const auto& test : tests) {
      const std::string name = test["name"];
      if (name.find("cross_depth_px") != std::string::npos) found[name] = test;
    }
    return found;
  };
  const auto json = nlohmann::json::parse(Dtr({"validate", In("deep.dtr"), "--json", "-"}).out);
  const auto tests = cross(json["tests"]);
  ASSERT_EQ(tests.size(), 2u);
  EXPECT_EQ(tests.at("cross_depth_px")["passed"], true);
  EXPECT_EQ(tests.at("cross_depth_px")["limit"], 1);
  EXPECT_EQ(tests.at("worst_view_cross_depth_px")["limit"], 2);
  EXPECT_GT(tests.at("cross_depth_px")["value"], 0);
  EXPECT_EQ(json["cross_depth"]["views"].size(), 7u);
  // The set's validation result is of this depth.
  const auto info = nlohmann::json::parse(DtrOk({"info", In("deep.dtr"), "--json", "-"}).out);
  EXPECT_EQ(cross(info["verdict"]["tests"]).at("cross_depth_px")["value"],
            tests.at("cross_depth_px")["value"]);
  const Ran strict = Dtr({"validate", In("deep.dtr"), "--max-cross", "1e-9", "--json", "-"});
  EXPECT_EQ(strict.code, kFailed);
  EXPECT_EQ(cross(nlohmann::json::parse(strict.out)["tests"]).at("cross_depth_px")["passed"],
            false);
  // Without depth there is nothing to say.
  EXPECT_TRUE(
      cross(nlohmann::json::parse(Dtr({"validate", In("set.dtr"), "--json", "-"}).out)["tests"])
          .empty());
}

TEST_F(ValidateReport, APageThatCannotBeWrittenIsRejectedBeforeAnyWork) {
  ExpectRejected(Dtr({"validate", In("set.dtr"), "--report", In("page.txt")}), kWrongUsage,
                 "expected a name ending in .html, found '.txt'");
}

// What is darkest is told, and what is the least where that is another.
TEST(AddMap, TheCaptionSaysWhatTheColoursMean) {
  const auto caption = [](const std::vector<double>& values) {
    report::HtmlReport page("map");
    pipeline::AddMap(page, "Error", " px", {640, 480},
                     {static_cast<int>(values.size()), 1, values});
    return page.Finish();
  };
  EXPECT_THAT(caption({2, 3, 4}),
              HasSubstr("Error: 0 px (dark; the smallest is 2 px) to 4 px (bright),"));
  EXPECT_THAT(caption({2, 30, 60}), HasSubstr("Error: 2 px (dark) to 60 px (bright), by the"));
  EXPECT_THAT(caption({0.01, 30, 600}),
              HasSubstr("Error: 0.6 px (dark with all below; the smallest is 0.01 px) to 600 px"));
}

}  // namespace
}  // namespace dtr::testing
