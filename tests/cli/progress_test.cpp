// What a long run tells where there is no terminal.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "calib/colmap/model_io.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/fake_sfm.h"

namespace dtr::testing {
namespace {

class ProgressTold : public CourtyardAndSet {};

TEST_F(ProgressTold, TheShareAndTheTimeLeft) {
  const Ran ran = DtrOk({"dataset", "make", "plane", "--views", "20", "--width", "32", "--height",
                         "32", "-o", In("made")});
  for (const int done : {2, 10, 18}) {
    const std::string line = "photos and truth " + std::to_string(done) + "/20, [0-9]+ s left\n";
    EXPECT_TRUE(std::regex_search(ran.err, std::regex(line))) << ran.err;
  }
  EXPECT_THAT(ran.err, ::testing::HasSubstr("photos and truth 20/20\n"));  // nothing is left
}

// COLMAP takes 300 MB and a second, more than everything else together.
TEST_F(ProgressTold, TheMemoryOfColmapIsCounted) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap, colmap::ReadModel(Shared("courtyard/sparse")));
  colmap.Fail("feature_extractor",
              "head -c 300000000 /dev/zero | tail -c 300000000 > /dev/null; sleep 1");
  const std::vector<std::string> arguments = {"build",    Photos(), "-o",    In("set.dtr"),
                                              "--engine", "none",   "--sfm", "colmap"};
  const Ran ran = DtrByItself(arguments);
  ASSERT_EQ(ran.code, 0) << ran.err;
  constexpr double kMinMib = 280;
  std::smatch told;
  ASSERT_TRUE(std::regex_search(ran.err, told, std::regex("features: .*at most ([0-9]+) MiB")))
      << ran.err;
  EXPECT_GE(std::stod(told[1]), kMinMib);
  const auto record = nlohmann::json::parse(Text(In("set.dtr") + "/report/run.json"));
  EXPECT_GE(record["stages"].back()["peak_rss_kib"], kMinMib * 1024);
  std::vector<std::string> recorded = record["command"];
  ASSERT_FALSE(recorded.empty());
  recorded.erase(recorded.begin());  // the program
  EXPECT_EQ(recorded, arguments);
}

}  // namespace
}  // namespace dtr::testing
