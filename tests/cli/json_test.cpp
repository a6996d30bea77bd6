// JSON names are an interface: scripts and acceptance rely on them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

void ExpectNames(const Json& object, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    EXPECT_TRUE(object.contains(name)) << name << " is missing in " << object.dump().substr(0, 300);
  }
}

// What a command prints with --json -: JSON alone, all of it.
Json OnStdout(std::vector<std::string> args, int code = 0) {
  args.insert(args.end(), {"--json", "-"});
  const Ran ran = Dtr(args);
  EXPECT_EQ(ran.code, code) << ran.err;
  const Json json = Json::parse(ran.out, nullptr, false);
  EXPECT_FALSE(json.is_discarded()) << "more than JSON on stdout:\n" << ran.out;
  return json;
}

TEST(JsonInterface, NamesAreThoseOfTheDesign) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "c");
  const std::string set = (folder / "set.dtr").string();
  const Json build =
      OnStdout({"build", (folder / "c/images").string(), "-o", set, "--poses",
                (folder / "c/sparse").string(), "--holdout", "every:4", "--max-size", "96"});
  ExpectNames(build, {"set", "views", "not_registered", "why_not_registered", "skipped",
                      "validation_passed", "stages", "peak_memory_mib"});
  ExpectNames(build["views"].at(0), {"name", "role", "width_px", "height_px"});
  ExpectNames(build["stages"].at(0), {"name", "wall_s", "cpu_s"});

  const Json info = OnStdout({"info", set, "--verify"});
  ExpectNames(info, {"views", "unit", "verdict"});
  EXPECT_EQ(info["views"].size(), static_cast<size_t>(kCourtyardViews));
  ExpectNames(info["views"].at(0), {"name", "role", "width_px", "height_px"});
  EXPECT_EQ(info["views"].at(0)["role"], "held_out");
  EXPECT_EQ(info["views"].at(1)["role"], "source");

  const Json advise = OnStdout({"advise", set, "-o", (folder / "advice.html").string()});
  ExpectNames(advise, {"places", "add", "adds_nothing"});
  ASSERT_FALSE(advise["places"].empty());
  ExpectNames(advise["places"].at(0), {"where", "center", "looks_along", "seen_share",
                                       "depthless_share", "unseen_share", "gap_deg", "poor"});
  EXPECT_THAT(Text(folder / "advice.html"), ::testing::HasSubstr("Cameras to add"));

  const Json evaluate =
      OnStdout({"evaluate", set, "--renderer", "cpu", "--depth", (folder / "c").string()});
  ExpectNames(evaluate, {"views", "mean", "not_registered", "depth"});
  for (const Json& scores : {evaluate["views"].at(0), evaluate["mean"]}) {
    ExpectNames(scores, {"psnr_db", "psnr_covered_db", "psnr_cc_db", "ssim", "coverage"});
  }
  EXPECT_EQ(evaluate["views"].at(0)["name"], "0000.jpg");
  ExpectNames(evaluate["depth"],
              {"share_within_1pct", "share_within_2pct", "median_relative_error", "outlier_share",
               "depth_completeness", "edge_displacement_px", "share_within_1_sigma",
               "sparsification_ratio", "sparsification_ratio_if_normal", "outlier_share_by_tenth"});

  const Json render = OnStdout(
      {"render", set, "--renderer", "cpu", "--like", "0000", "-o", (folder / "view.png").string()});
  EXPECT_TRUE(render["skipped"].is_array());
  ExpectNames(render["frames"].at(0), {"file", "ms", "views_used", "coverage"});

  const Json passed = OnStdout({"validate", set});
  ExpectNames(passed, {"passed", "tests"});
  ExpectNames(passed["tests"].at(0), {"name", "value", "limit", "passed", "reason"});
  EXPECT_EQ(passed["passed"], true);
  // A limit that is broken is told by the exit code too.
  EXPECT_EQ(OnStdout({"validate", set, "--max-rms", "1e-15"}, 1)["passed"], false);
}

}  // namespace
}  // namespace dtr::testing
