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
  for (const char* section : {"Photos, depth, uncertainty", "From above", "Worst views",
                              "Which view contributes where"}) {
    EXPECT_THAT(page, HasSubstr(section));
  }
  EXPECT_THAT(page, HasSubstr("0001.jpg"));
  EXPECT_THAT(page, HasSubstr("data:image/svg+xml"));
  EXPECT_THAT(page, HasSubstr("not validated"));  // nobody did
  EXPECT_THAT(page, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  DtrOk({"inspect", Set(), "-o", In("two.html"), "--threads", "3"});
  EXPECT_EQ(Text(In("two.html")), page);
}

TEST_F(Inspect, AViewWhosePhotoIsAnothersComesFirstAmongTheWorst) {
  std::filesystem::copy(Set(), In("s.dtr"), std::filesystem::copy_options::recursive);
  nlohmann::json json = nlohmann::json::parse(Text(In("s.dtr/set.json")));
  std::vector<nlohmann::json*> sources;
  for (auto& view : json["frames"][0]["views"]) {
    if (view["role"] == "source") sources.push_back(&view);
  }
  ASSERT_GE(sources.size(), 4u);
  const std::string spoiled = (*sources[2])["name"];
  const auto first_of_the_worst = [&] {
    DtrOk({"inspect", In("s.dtr"), "-o", In("page.html"), "--force"});
    std::string page = Text(In("page.html"));
    page = page.substr(page.find("Worst views"));
    std::string first;
    size_t least = std::string::npos;
    for (const auto* view : sources) {
      const std::string name = (*view)["name"];
      if (const size_t at = page.find(name); at < least) {
        least = at;
        first = name;
      }
    }
    return first;
  };
  EXPECT_NE(first_of_the_worst(), spoiled) << "choose another view for this test";
  (*sources[2])["image"] = (*sources.back())["image"];
  WriteFileAtomically(In("s.dtr/set.json"), json.dump());
  EXPECT_EQ(first_of_the_worst(), spoiled);
}

TEST_F(Inspect, DrawsByTheSetsOwnOptions) {
  std::filesystem::copy(Set(), In("s.dtr"), std::filesystem::copy_options::recursive);
  DtrOk({"inspect", In("s.dtr"), "-o", In("usual.html")});
  nlohmann::json json = nlohmann::json::parse(Text(In("s.dtr/set.json")));
  json["pruned"]["render"] = {{"views", 1}};
  WriteFileAtomically(In("s.dtr/set.json"), json.dump());
  DtrOk({"inspect", In("s.dtr"), "-o", In("pruned.html")});
  EXPECT_NE(Text(In("usual.html")), Text(In("pruned.html")));
}

TEST_F(Inspect, SaysWhatStagesCost) {
  std::filesystem::copy(Set(), In("s.dtr"), std::filesystem::copy_options::recursive);
  std::filesystem::create_directories(In("s.dtr/report"));
  WriteFileAtomically(In("s.dtr/report/run.json"),
                      R"({"stages":[{"name":"depth","wall_s":12.5,"cpu_s":20.25,
                          "peak_rss_kib":1000000},{"name":7}, 8]})");
  DtrOk({"inspect", In("s.dtr"), "-o", In("page.html"), "--force"});
  const std::string page = Text(In("page.html"));
  EXPECT_THAT(page, HasSubstr("12.5 s"));
  EXPECT_THAT(page, HasSubstr("1024 MB"));
  WriteFileAtomically(In("s.dtr/report/run.json"), "{\"stages\":[");
  ExpectRejected(Dtr({"inspect", In("s.dtr"), "-o", In("page.html"), "--force"}), kFailed,
                 "run.json: expected JSON, found something else");
}

TEST_F(Inspect, WhatCannotWorkIsSaidInOneLine) {
  ExpectRejected(Dtr({"inspect", In("absent.dtr"), "-o", In("page.html"), "--force"}), kFailed,
                 "expected the folder of a D+TR set, found nothing");
  ExpectRejected(Dtr({"inspect", Set(), "-o", In("page.pdf")}), kWrongUsage,
                 "expected a name ending in .html");
}

}  // namespace
}  // namespace dtr::testing
