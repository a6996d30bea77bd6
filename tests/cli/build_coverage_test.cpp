// `dtr build` ends with where the capture is thin, from the depth that it found.
#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

using Json = nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class BuildCoverage : public ::testing::Test {
 protected:
  void SetUp() override { MakeSmallCourtyard(folder_ / "courtyard"); }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  Ran Build(const std::string& set, std::vector<std::string> further) const {
    further.insert(further.begin(), {"build", In("courtyard/images"), "-o", In(set), "--poses",
                                     In("courtyard/sparse"), "--json", In(set + ".json")});
    return DtrOk(further);
  }
  TemporaryFolder folder_;
};

TEST_F(BuildCoverage, IsWhatAdviseFindsAndTheSameForAnyNumberOfThreads) {
  // Three photos in the middle of the arc are held out: there the capture has a gap.
  const std::vector<std::string> quick{
      "--passes",     "0", "--iterations", "1",
      "--neighbours", "2", "--holdout",    "0002.jpg,0003.jpg,0004.jpg",
      "--threads"};
  const auto with_threads = [&](const std::string& threads) {
    std::vector<std::string> words = quick;
    words.push_back(threads);
    return words;
  };
  const Ran ran = Build("one.dtr", with_threads("1"));
  const std::vector<std::string> lines = Json::parse(Text(In("one.dtr.json")))["coverage"];
  ASSERT_EQ(lines.size(), 2u);
  for (const std::string& line : lines) {
    EXPECT_THAT(ran.out, HasSubstr("  " + line + "\n"));
    EXPECT_THAT(
        Json::parse(Text(In("one.dtr/report/run.json")))["log"].get<std::vector<std::string>>(),
        Contains(line));
  }
  EXPECT_THAT(ran.out, HasSubstr("dtr advise " + In("one.dtr") + " says where"));

  const Json advice = Json::parse(DtrOk({"advise", In("one.dtr"), "--json", "-"}).out);
  int poor = 0;
  for (const Json& place : advice["places"]) poor += place["poor"].get<bool>();
  EXPECT_GT(poor, 0) << "nothing would be tested";
  EXPECT_THAT(lines[0], HasSubstr("coverage: " + std::to_string(poor) + " of " +
                                  std::to_string(advice["places"].size()) + " positions"));
  ASSERT_FALSE(advice["add"].empty());
  EXPECT_THAT(lines[0], HasSubstr(advice["add"][0]["where"].get<std::string>()));
  if (advice["adds_nothing"].empty()) {
    EXPECT_EQ(lines[1], "coverage: every camera shows something of its own");
  } else {
    EXPECT_THAT(lines[1], HasSubstr(std::to_string(advice["adds_nothing"].size()) +
                                    " of the cameras add nothing"));
  }

  Build("two.dtr", with_threads("2"));
  EXPECT_EQ(Json::parse(Text(In("two.dtr.json")))["coverage"], Json(lines));
}

TEST_F(BuildCoverage, NothingIsSaidWithoutDepth) {
  const Ran ran = Build("set.dtr", {"--engine", "none"});
  EXPECT_THAT(Json::parse(Text(In("set.dtr.json")))["coverage"], IsEmpty());
  EXPECT_EQ(ran.out.find("coverage:"), std::string::npos);
}

}  // namespace
}  // namespace dtr::testing
