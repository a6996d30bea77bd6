// `dtr build --rig` as its users meet it: photos of two cameras, left/ and right/, that are fixed
// to each other. COLMAP is a stand-in that leaves the true model in another unit, with noise.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/base/random.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/courtyard_rig.h"
#include "tests/cli/run_dtr.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

constexpr int kTimeSteps = 5;
constexpr double kUnit = 0.31;    // scene units, which are metres, per unit of the model
constexpr double kNoisePx = 0.2;  // of the features
constexpr std::uint32_t kLeftId = 7, kRightId = 3;  // of the cameras in COLMAP's database

const PinholeCamera kLeft(192, 128, 150, 150, 96, 64), kRight(192, 128, 154, 154, 94, 66);
const CourtyardRig kRig{kLeft, kRight};

std::vector<CourtyardPhoto> RigPhotos() { return PhotosOf(kRig, kTimeSteps); }

class BuildRig : public ::testing::Test {
 protected:
  void SetUp() override {
    RenderCourtyard(folder_ / "photos", RigPhotos());
    WriteRig("rig.json", RightFromLeft());
  }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  void WriteRig(const std::string& name, const Pose& right_from_left) const {
    calib::WriteCalibration(folder_ / name, CalibrationOf(kRig, right_from_left));
  }
  // What the mapper leaves of these photos: the truth but for noise, numbered in the order of
  // names.
  void LeaveModel(colmap::testing::FakeColmap& colmap,
                  const std::vector<CourtyardPhoto>& photos = RigPhotos()) const {
    calib::SfmModel model = CourtyardModel(photos, 1 / kUnit);
    Random random(3);
    std::vector<std::string> aliases;
    std::vector<int> cameras;
    for (calib::SfmImage& image : model.images) {
      aliases.push_back(fmt::format("{:06}.png", aliases.size()));
      image.name = aliases.back();
      image.camera_id = image.camera_id == 1 ? kLeftId : kRightId;
      cameras.push_back(static_cast<int>(image.camera_id));
      for (auto& feature : image.features) {
        feature.pixel += kNoisePx * Eigen::Vector2d(random.Normal(), random.Normal());
      }
    }
    model.cameras = {{kLeftId, model.cameras.at(1)}, {kRightId, model.cameras.at(2)}};
    colmap::WriteModel(colmap / "model.0", model, colmap::Format::kBinary);
    // A photo that is held out strictly finds its place where it is true, in the model's unit.
    const Pose held_out = RigPhotos().back().cam_from_scene;
    model.images.push_back(
        {99, "held_000000.png", kRightId, {held_out.rotation, held_out.translation / kUnit}, {}});
    colmap::WriteModel(colmap / "output", model, colmap::Format::kBinary);
    aliases.emplace_back("held_000000.png");
    cameras.push_back(kRightId);
    colmap.LeaveDatabase(aliases, cameras);
  }
  Ran Build(std::vector<std::string> further) const {
    further.insert(further.begin(), {"build", In("photos"), "-o", In("set.dtr"), "--engine", "none",
                                     "--sfm", "colmap"});
    return Dtr(further);
  }
  TemporaryFolder folder_;
};

Json TestOf(const Json& validation, const std::string& name) {
  for (const Json& test : validation["tests"]) {
    if (test["name"] == name) return test;
  }
  ADD_FAILURE() << "no test " << name;
  return {};
}

TEST_F(BuildRig, TheRigGivesPlacesAndMetres) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap);
  const Ran ran = Build({"--rig", In("rig.json")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  // One lens for each camera of the rig, beginning with its focal length.
  std::vector<std::string> extractions;
  for (const std::string& call : colmap.Calls()) {
    if (call.starts_with("feature_extractor")) extractions.push_back(call);
  }
  ASSERT_EQ(extractions.size(), 2u);
  EXPECT_THAT(extractions[0], HasSubstr("--ImageReader.camera_params 150,"));
  EXPECT_THAT(extractions[1], HasSubstr("--ImageReader.camera_params 154,"));

  const DtrSet set = io::ReadSet(folder_ / "set.dtr");
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  const auto& views = set.frames.front().views;
  const std::vector<CourtyardPhoto> truth = RigPhotos();
  ASSERT_EQ(views.size(), truth.size());
  const auto apart = [&](size_t a, size_t b) {
    return (views[a].CenterInWorld() - views[b].CenterInWorld()).norm();
  };
  const auto truly_apart = [&](size_t a, size_t b) {
    return (truth[a].cam_from_scene.TargetOriginInSource() -
            truth[b].cam_from_scene.TargetOriginInSource())
        .norm();
  };
  for (size_t i = 0; i < kTimeSteps; ++i) {
    EXPECT_NEAR(apart(i, i + kTimeSteps), truly_apart(i, i + kTimeSteps), 1e-9);
    EXPECT_DOUBLE_EQ(views[i].camera.fx_px(), kLeft.fx_px());
    EXPECT_DOUBLE_EQ(views[i + kTimeSteps].camera.cy_px(), kRight.cy_px());
  }
  // From one time step to another the scale is as good as observations of 0.2 px on 192 pixels make
  // it.
  EXPECT_NEAR(apart(0, kTimeSteps - 1) / truly_apart(0, kTimeSteps - 1), 1, 0.01);

  const Json info = Json::parse(DtrOk({"info", In("set.dtr"), "--json", "-"}).out);
  const Json places = TestOf(info["verdict"], "rig_places_px");
  EXPECT_TRUE(places["passed"]) << places;
  EXPECT_LT(places["value"], 1e-6);
  EXPECT_TRUE(TestOf(info["verdict"], "camera_difference_sigmas")["passed"]);
  const Json& rig = info["provenance"]["calibration"]["rig"];
  EXPECT_EQ(rig["file"], "rig.json");
  EXPECT_EQ(rig["frames"], kTimeSteps);
  EXPECT_NEAR(rig["scale"], kUnit, 0.01 * kUnit);
  EXPECT_THAT(
      DtrOk({"info", In("set.dtr")}).out,
      HasSubstr("rig: rig.json with cameras left, right; positions and scale are the rig's, 5 "
                "time steps"));

  // A set whose scale has been changed since is no longer the rig's, and validate says so.
  DtrOk({"calibrate", "scale", In("set.dtr"), "--distance",
         fmt::format("{},{}=1m", views[0].id, views[kTimeSteps].id), "-o", In("scaled.dtr")});
  const Ran scaled = Dtr({"validate", In("scaled.dtr"), "--json", "-"});
  EXPECT_EQ(scaled.code, kFailed);
  const Json told = Json::parse(scaled.out);
  EXPECT_FALSE(TestOf(told, "rig_places_px")["passed"]);
  EXPECT_TRUE(TestOf(told, "camera_difference_sigmas")["passed"]);
}

TEST_F(BuildRig, AStrictlyHeldOutPhotoTakesItsCamerasLens) {
  colmap::testing::FakeColmap colmap;
  std::vector<CourtyardPhoto> sources = RigPhotos();
  const std::string held_out = sources.back().name;
  sources.pop_back();
  LeaveModel(colmap, sources);
  const Ran ran =
      Build({"--rig", In("rig.json"), "--holdout", held_out, "--holdout-strict", "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  // COLMAP knows the camera under the number that it gave it.
  EXPECT_THAT(
      colmap.Calls(),
      ::testing::Contains(HasSubstr(fmt::format("--ImageReader.existing_camera_id {}", kRightId))));
  const DtrSet set = io::ReadSet(folder_ / "set.dtr");
  const View& view = set.frames.front().views.back();
  EXPECT_EQ(view.name, held_out);
  EXPECT_EQ(view.role, ViewRole::kHeldOut);
  EXPECT_DOUBLE_EQ(view.camera.fx_px(), kRight.fx_px());
  const Json validation = Json::parse(set.validation_json);
  EXPECT_TRUE(TestOf(validation, "rig_places_px")["passed"]);
  EXPECT_TRUE(TestOf(validation, "cameras_untested")["passed"]);
}

TEST_F(BuildRig, ARigThatHasMovedSinceIsRejected) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap);
  Pose turned = RightFromLeft();
  turned.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitY())) * turned.rotation;
  WriteRig("turned.json", turned);
  ExpectRejected(Build({"--rig", In("turned.json")}), kFailed,
                 "rig: expected photos of this rig, found residuals of");
  EXPECT_FALSE(fs::exists(In("set.dtr")));
}

TEST_F(BuildRig, PhotosThatAreNotTheRigsAreRejectedBeforeAnyWork) {
  colmap::testing::FakeColmap colmap;
  const std::vector<std::string> with_rig{"--rig", In("rig.json")};
  ExpectRejected(Build({"--rig", In("absent.json")}), kWrongUsage,
                 "or a stereo pair of OpenCV (.yml), found nothing");
  ExpectRejected(Build({"--rig", In("rig.json"), "--poses", In("photos")}), kWrongUsage,
                 "--rig: sets the poses of what SfM finds; expected no --poses beside it");
  ExpectRejected(Build({"--rig", In("rig.json"), "--no-refine"}), kWrongUsage,
                 "--rig: is bundle adjustment; expected no --no-refine beside it");
  calib::Calibration alone = CalibrationOf(kRig);
  alone.cameras.pop_back();
  calib::WriteCalibration(folder_ / "alone.json", alone);
  ExpectRejected(Build({"--rig", In("alone.json")}), kFailed,
                 "expected a rig of 2 cameras or more, found 1");

  io::WriteImage(folder_ / "photos/hand.png", ImageRgb8(192, 128, 3, 100));
  ExpectRejected(Build(with_rig), kFailed,
                 "photo hand.png: expected one of the cameras left, right: CAMERA/NAME or CAMERA "
                 "and a number");
  fs::remove(folder_ / "photos/hand.png");
  io::WriteImage(folder_ / "photos/right/0009.png", ImageRgb8(96, 64, 3, 100));
  ExpectRejected(Build(with_rig), kFailed,
                 "photo right/0009.png: expected 192 x 128 px as camera right was calibrated with, "
                 "found 96 x 64");
  fs::remove(folder_ / "photos/right/0009.png");
  for (int i = 0; i < kTimeSteps; ++i) {
    fs::rename(folder_ / fmt::format("photos/right/{:04}.png", i),
               folder_ / fmt::format("photos/right/1{:03}.png", i));
  }
  ExpectRejected(Build(with_rig), kFailed,
                 "expected photos taken at one time from two cameras that stand apart, found none");
  EXPECT_TRUE(colmap.Calls().empty());
}

TEST_F(BuildRig, VideosMustBeOfTheSameTimeSteps) {
  fs::create_directories(folder_ / "videos");
  for (const char* name : {"left.mp4", "right.mp4"}) {
    WriteFileAtomically(folder_ / "videos" / name, "never read");
  }
  const auto build = [&](std::vector<std::string> further) {
    further.insert(further.begin(),
                   {"build", In("videos"), "-o", In("set.dtr"), "--rig", In("rig.json")});
    return Dtr(further);
  };
  ExpectRejected(build({}), kWrongUsage,
                 "--rig: needs frames taken at the same times; expected --synchronised for videos");
  WriteFileAtomically(folder_ / "videos/timestamps.csv", "sync_index,cam_id,frame_index\n");
  ExpectRejected(build({"--synchronised"}), kWrongUsage,
                 "expected videos whose frames of equal number are taken at one time, found");
}

}  // namespace
}  // namespace dtr::testing
