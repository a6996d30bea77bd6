// What `dtr bench` found, on the page of `dtr inspect`.
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "tests/support/small_courtyard_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class InspectBench : public SmallCourtyardSet {
 protected:
  /// The set, where a sweep may be written beside it.
  void SetUp() override { fs::copy(Set(), In("scene.dtr"), fs::copy_options::recursive); }
  void Bench(std::vector<std::string> further = {}) const {
    further.insert(further.begin(),
                   {"bench", In("scene.dtr"), "--renderer", "cpu", "--views", "2,1", "--size",
                    "48x0", "--repeats", "1", "--cameras", "1", "--max-points", "3"});
    DtrOk(further);
  }
  Ran Inspect(std::vector<std::string> further = {}) const {
    further.insert(further.begin(), {"inspect", In("scene.dtr"), "-o", In("page.html"), "--force"});
    return Dtr(further);
  }
  std::string Page(std::vector<std::string> further = {}) const {
    const Ran ran = Inspect(std::move(further));
    EXPECT_EQ(ran.code, 0) << ran.err;
    return Text(In("page.html"));
  }
};

constexpr char kHeading[] = "What settings cost and are worth";

TEST_F(InspectBench, ItsPlotsAndFindingsAreThoseOfItsOwnPage) {
  EXPECT_THAT(Page(), Not(HasSubstr(kHeading)));
  Bench();
  const Json stage = Json::parse(Text(In("scene-bench/bench.json")))["stages"][0];
  const std::string page = Page(), own = Text(In("scene-bench/bench.html"));
  EXPECT_THAT(page, HasSubstr(kHeading));
  const std::string plot = Text(In("scene-bench/render.svg"));
  EXPECT_THAT(own, HasSubstr(plot));
  EXPECT_THAT(page, HasSubstr(plot));
  // From the stage's heading on both pages are the same.
  const size_t stages = own.find("<h2>render: ");
  ASSERT_NE(stages, std::string::npos);
  EXPECT_THAT(page, HasSubstr(own.substr(stages, own.rfind("</table>") - stages)));
  EXPECT_THAT(page, HasSubstr("the default is "));
  for (const Json& point : stage["points"]) {
    EXPECT_THAT(
        page, HasSubstr("--point " + point["command"].get<std::string>().substr(
                                         point["command"].get<std::string>().find("method="), 20)));
  }
}

TEST_F(InspectBench, AnotherFolderIsTakenWhenItIsNamed) {
  Bench({"-o", In("elsewhere")});
  EXPECT_THAT(Page(), Not(HasSubstr(kHeading)));
  EXPECT_THAT(Page({"--bench", In("elsewhere")}), HasSubstr(kHeading));
  ExpectRejected(Inspect({"--bench", In("nowhere")}), kFailed,
                 "expected bench.json of dtr bench in it, found none");
}

TEST_F(InspectBench, WhatIsNoSweepIsRejected) {
  Bench();
  const fs::path file = In("scene-bench/bench.json");
  const std::string good = Text(file);
  for (size_t length = 0; length + 2 < good.size(); length += 997) {
    WriteFileAtomically(file, good.substr(0, length));
    EXPECT_EQ(Inspect().code, kFailed) << length;
  }
  const auto refused = [&](const std::function<void(Json&)>& change, const std::string& words) {
    Json json = Json::parse(good);
    change(json);
    WriteFileAtomically(file, json.dump());
    const Ran ran = Inspect();
    EXPECT_EQ(ran.code, kFailed);
    EXPECT_THAT(ran.err, HasSubstr("bench.json: " + words));
  };
  refused([](Json& json) { json["stages"][0]["points"][1]["cost"] = -1; },
          "stages[0].points[1].cost: ");
  refused([](Json& json) { json["stages"][0]["front"][0] = 99; }, "stages[0].front: ");
  refused([](Json& json) { json["stages"][0]["knee"] = 3; }, "stages[0].knee: ");
  refused([](Json& json) { json["stages"][0]["points"] = Json::array(); }, "stages[0].points: ");
  refused([](Json& json) { json["stages"][0]["default"]["at"] = -1; }, "stages[0].default.at: ");
  refused([](Json& json) { json["stages"][0]["points"][0]["options"] = Json::object(); },
          "stages[0].points[0].options: ");
}

}  // namespace
}  // namespace dtr::testing
