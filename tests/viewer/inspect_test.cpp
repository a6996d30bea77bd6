// `dtr inspect`: one page that needs nothing else.
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "tests/support/small_courtyard_set.h"

namespace dtr::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using Inspect = SmallCourtyardSet;

TEST_F(Inspect, WritesOnePageThatNeedsNothingElseTheSameEveryTime) {
  DtrOk({"inspect", Set(), "-o", In("one.html"), "--threads", "1"});
  const std::string page = Text(In("one.html"));
  for (const char* section : {"Can the calibration be trusted?", "Photos, depth, uncertainty",
                              "From above", "Worst views", "Which view contributes where"}) {
    EXPECT_THAT(page, HasSubstr(section));
  }
  EXPECT_THAT(page, HasSubstr("0001.jpg"));
  EXPECT_THAT(page, HasSubstr("data:image/svg+xml"));
  EXPECT_THAT(page, HasSubstr("never validated"));  // nobody did
  EXPECT_THAT(page, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  DtrOk({"inspect", Set(), "-o", In("two.html"), "--threads", "3"});
  EXPECT_EQ(Text(In("two.html")), page);
}

TEST_F(Inspect, SaysWhatStagesCost) {
  std::filesystem::copy(Set(), In("s.dtr"), std::filesystem::copy_options::recursive);
  std::filesystem::create_directories(In("s.dtr/report"));
  WriteFileAtomically(In("s.dtr/report/run.json"),
                      R"({"stages":[{"name":"depth","wall_s":12.5,"cpu_s":20.25,
                          "peak_rss_kib":1000000},{"name":7}, 8]})");
  DtrOk({"inspect", In("s.dtr"), "-o", In("page.html")});
  const std::string page = Text(In("page.html"));
  EXPECT_THAT(page, HasSubstr("12.5 s"));
  EXPECT_THAT(page, HasSubstr("1024 MB"));
  WriteFileAtomically(In("s.dtr/report/run.json"), "{\"stages\":[");
  ExpectRefused(Dtr({"inspect", In("s.dtr"), "-o", In("page.html")}), kFailed,
                "run.json: expected JSON, found something else");
}

TEST_F(Inspect, WhatCannotWorkIsSaidInOneLine) {
  ExpectRefused(Dtr({"inspect", In("absent.dtr"), "-o", In("page.html")}), kFailed,
                "expected the folder of a D+TR set, found nothing");
  ExpectRefused(Dtr({"inspect", Set(), "-o", In("page.pdf")}), kWrongUsage,
                "expected a name ending in .html");
}

}  // namespace
}  // namespace dtr::testing
