// What the default engine finds where the truth is known, as a user calls it. The floors lie a
// point below what it reached when they were written: this is no target but an alarm.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dtr/base/temporary_folder.h"
#include "tests/cli/run_dtr.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

struct Scene {
  std::string name;
  std::string views;
  double within_1px;  ///< floor, share of all evaluated pixels
  double outliers;    ///< ceiling, share of kept pixels off by more than 2 %
};

class DepthAccuracy : public ::testing::TestWithParam<Scene> {};

TEST_P(DepthAccuracy, OfSmallPhotosWithTrueCameras) {
  const TemporaryFolder work;
  const std::string truth = (work.path() / "truth").string();
  const std::string bare = (work.path() / "bare.dtr").string();
  const std::string set = (work.path() / "set.dtr").string();
  const std::string json = (work.path() / "scores.json").string();
  DtrOk({"dataset", "make", GetParam().name, "-o", truth, "--views", GetParam().views, "--width",
         "480", "--height", "320"});
  DtrOk({"build", truth + "/images", "--poses", truth + "/cameras.json", "--engine", "none",
         "--max-size", "0", "-o", bare});
  DtrOk({"stereo", bare, "-o", set});
  DtrOk({"evaluate", set, "--depth", truth, "--json", json});
  const auto depth = nlohmann::json::parse(Text(json)).at("depth");
  EXPECT_GT(depth.at("share_within_1px").get<double>(), GetParam().within_1px);
  EXPECT_LT(depth.at("outlier_share").get<double>(), GetParam().outliers);
}

INSTANTIATE_TEST_SUITE_P(Scenes, DepthAccuracy,
                         ::testing::Values(Scene{"courtyard", "8", 0.91, 0.033},
                                           Scene{"room", "16", 0.962, 0.019}),
                         [](const auto& scene) { return scene.param.name; });

}  // namespace
}  // namespace dtr::testing
