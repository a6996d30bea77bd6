// `dtr build --rig` from end to end, with the real COLMAP: photos of two cameras that are fixed to
// each other, rendered, so that the truth is known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/files/calibration.h"
#include "calib/similarity.h"
#include "dtr/base/process.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"

namespace dtr::testing {
namespace {

using Json = nlohmann::json;

constexpr int kInstants = 7;
// 480 px are the least at which SIFT finds enough here. The two lenses are different ones.
const PinholeCamera kLeft(480, 320, 380, 380, 241, 159), kRight(480, 320, 400, 400, 236, 164);

// Half a metre to the right, looking a little inwards.
Pose RightFromLeft() {
  Pose pose;
  pose.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(-0.06, Eigen::Vector3d(0.1, 1, 0).normalized()));
  pose.translation = pose.rotation * Eigen::Vector3d(-0.5, 0.02, 0.01);
  return pose;
}

std::vector<CourtyardPhoto> Photos() {
  std::vector<CourtyardPhoto> photos;
  int instant = 0;
  for (const Pose& left : CourtyardArc(kInstants)) {
    photos.push_back({fmt::format("left/{:04}.png", instant), kLeft, left});
    photos.push_back({fmt::format("right/{:04}.png", instant), kRight, RightFromLeft() * left});
    ++instant;
  }
  return photos;
}

calib::Calibration RigCalibration() {
  calib::Calibration rig;
  rig.board = calib::BoardFromText("chessboard:9x6:25mm");
  for (const bool right : {false, true}) {
    const PinholeCamera& c = right ? kRight : kLeft;
    calib::CalibratedCamera camera;
    camera.name = right ? "right" : "left";
    camera.camera = {calib::LensModel::kPinhole,
                     c.width_px(),
                     c.height_px(),
                     {c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()}};
    camera.covariance = 0.01 * Eigen::MatrixXd::Identity(4, 4);
    camera.rms_px = camera.sigma_px = 0.1;
    if (right) {
      camera.cam_from_rig = RightFromLeft();
      camera.place_covariance = 1e-8 * Eigen::MatrixXd::Identity(6, 6);
    }
    rig.cameras.push_back(std::move(camera));
  }
  return rig;
}

TEST(BuildRigByColmap, PhotosOfARigBecomeASetInMetresWithItsPlaces) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "SKIPPED: colmap is absent";
  const TemporaryFolder folder;
  const auto photos = Photos();
  RenderCourtyard(folder / "photos", photos);
  calib::WriteCalibration(folder / "rig.json", RigCalibration());
  const std::string set_folder = (folder / "set.dtr").string();
  DtrOk({"build", (folder / "photos").string(), "-o", set_folder, "--engine", "none", "--rig",
         (folder / "rig.json").string()});
  const DtrSet set = io::ReadSet(set_folder);
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  const auto& views = set.frames.front().views;
  ASSERT_EQ(views.size(), photos.size()) << "a photo did not register";
  std::vector<Eigen::Vector3d> found, truth;
  const View* left = nullptr;
  for (const CourtyardPhoto& photo : photos) {
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const View& v) { return v.name == photo.name; });
    ASSERT_NE(view, views.end()) << photo.name;
    EXPECT_DOUBLE_EQ(view->camera.fx_px(), photo.camera.fx_px());
    found.push_back(view->CenterInWorld());
    truth.push_back(photo.cam_from_scene.TargetOriginInSource());
    // The rig's own length, to rounding.
    if (photo.name.starts_with("right")) {
      EXPECT_NEAR((left->CenterInWorld() - found.back()).norm(),
                  RightFromLeft().TargetOriginInSource().norm(), 1e-9);
    }
    left = &*view;
  }
  const calib::Similarity aligned = calib::AlignPoints(found, truth);
  double worst = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    worst = std::max(worst, (aligned * found[i] - truth[i]).norm());
  }
  std::printf("scale %.5f, worst place %.2f mm\n", aligned.scale, 1e3 * worst);
  EXPECT_NEAR(aligned.scale, 1, 0.01);
  EXPECT_LT(worst, 0.02);  // 2 cm on an arc of metres; the rig's own arm is half a metre
  const Json info = Json::parse(DtrOk({"info", set_folder, "--json", "-"}).out);
  for (const Json& test : info["verdict"]["tests"]) {
    std::printf("%s %s %s\n", test["passed"].get<bool>() ? "passed" : "FAILED",
                test["name"].get<std::string>().c_str(), test["value"].dump().c_str());
    EXPECT_TRUE(test["passed"].get<bool>()) << test.dump();
  }
}

}  // namespace
}  // namespace dtr::testing
