// `dtr build --rig` from end to end, with the real COLMAP: rendered photos of two cameras that are
// fixed to each other, so that the truth is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/similarity.h"
#include "dtr/base/process.h"
#include "dtr/io/set_io.h"
#include "tests/cli/courtyard_rig.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

using Json = nlohmann::json;

constexpr int kTimeSteps = 7;
// 480 px are the least at which SIFT finds enough here. The two lenses are different ones.
const CourtyardRig kRig{{480, 320, 380, 380, 241, 159}, {480, 320, 400, 400, 236, 164}};
// The truth is a rig a metre from walls: places to a hundredth of its own arm of half a metre.
constexpr double kPlaceM = 0.005, kScale = 0.005;

TEST(BuildRigByColmap, PhotosOfARigBecomeASetInMetresWithItsPlaces) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "colmap is absent";
  const TemporaryFolder folder;
  const auto photos = PhotosOf(kRig, kTimeSteps);
  RenderCourtyard(folder / "photos", photos);
  calib::WriteCalibration(folder / "rig.json", CalibrationOf(kRig));
  const std::string set_folder = (folder / "set.dtr").string();
  DtrOk({"build", (folder / "photos").string(), "-o", set_folder, "--engine", "none", "--rig",
         (folder / "rig.json").string()});

  const DtrSet set = io::ReadSet(set_folder);
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  const auto& views = set.frames.front().views;
  ASSERT_EQ(views.size(), photos.size()) << "a photo did not register";
  std::vector<Eigen::Vector3d> found, truth;
  for (size_t i = 0; i < photos.size(); ++i) {
    ASSERT_EQ(views[i].name, photos[i].name);
    EXPECT_DOUBLE_EQ(views[i].camera.fx_px(), photos[i].camera.fx_px());
    found.push_back(views[i].CenterInWorld());
    truth.push_back(photos[i].cam_from_scene.TargetOriginInSource());
  }
  for (size_t i = 0; i < kTimeSteps; ++i) {  // the rig's own arm, to rounding
    EXPECT_NEAR((found[i] - found[i + kTimeSteps]).norm(),
                RightFromLeft().TargetOriginInSource().norm(), 1e-9);
  }
  const calib::Similarity aligned = calib::AlignPoints(found, truth);
  double worst = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    worst = std::max(worst, (aligned * found[i] - truth[i]).norm());
  }
  std::printf("scale %.5f, worst position %.2f mm\n", aligned.scale, 1e3 * worst);
  EXPECT_NEAR(aligned.scale, 1, kScale);
  EXPECT_LT(worst, kPlaceM);
  const Json info = Json::parse(DtrOk({"info", set_folder, "--json", "-"}).out);
  for (const Json& test : info["verdict"]["tests"]) {
    EXPECT_TRUE(test["passed"].get<bool>()) << test.dump();
  }
}

}  // namespace
}  // namespace dtr::testing
