// Held-out photos are measured with, and nothing else: no byte of the set may depend on their
// pixels.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dtr/base/process.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr char kChanged[] = "0003";  // every:3 holds out 0000, 0003 and 0006

// Two folders with the same photos but for a held-out one, in a/ and b/.
class TwoCaptures : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "a");
    fs::copy(folder_ / "a", folder_ / "b", fs::copy_options::recursive);
    ChangePhoto(folder_ / "b" / "images" / (std::string(kChanged) + ".jpg"));
  }
  // Builds from each folder with these further arguments.
  void Build(const std::vector<std::string>& further) {
    for (const char* side : {"a", "b"}) {
      std::vector<std::string> args = {
          "build", (folder_ / side / "images").string(), "-o", Set(side), "--holdout", "every:3"};
      args.insert(args.end(), further.begin(), further.end());
      DtrOk(args);
    }
  }
  std::string Set(const std::string& side) const { return (folder_ / side / "set.dtr").string(); }
  std::vector<std::string> Differences() const {
    return DifferingFiles(Contents(Set("a")), Contents(Set("b")));
  }
  Json Scores(const std::string& side) const {
    const fs::path file = folder_ / (side + ".json");
    DtrOk({"evaluate", Set(side), "--renderer", "cpu", "--json", file.string()});
    return Json::parse(Text(file))["views"];
  }
  // Every score but that of the changed photo is the same.
  void ExpectOnlyItsOwnScoreToDiffer() const {
    Json a = Scores("a"), b = Scores("b");
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_GT(a[i]["coverage"].get<double>(), 0.2) << "almost nothing is compared";
      a[i].erase("render_ms");
      b[i].erase("render_ms");
      if (a[i]["name"] == std::string(kChanged) + ".jpg") {
        EXPECT_NE(a[i]["psnr_db"], b[i]["psnr_db"]);
      } else {
        EXPECT_EQ(a[i], b[i]);
      }
    }
  }
  TemporaryFolder folder_;
};

TEST_F(TwoCaptures, WithFrozenPosesAHeldOutPhotoChangesNoByteOutsideHeldOut) {
  Build({"--poses", (folder_ / "a" / "sparse").string(), "--engine", "sgbm", "--max-size", "96"});
  EXPECT_THAT(Differences(),
              ::testing::ElementsAre("held_out/files.json",
                                     "held_out/images/" + std::string(kChanged) + ".png"));
  for (const char* side : {"a", "b"}) DtrOk({"info", Set(side), "--verify"});
  ExpectOnlyItsOwnScoreToDiffer();
}

}  // namespace
}  // namespace dtr::testing
