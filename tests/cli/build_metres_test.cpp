// `dtr build` and `dtr calibrate photos` with --gps and --distance. COLMAP is a stand-in that
// leaves the true model in another unit, with noise.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/base/random.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/gps_photo.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

constexpr double kUnit = 0.31;     // scene units, which are metres, per unit of the model
constexpr double kNoisePx = 0.2;   // of the features
constexpr double kPlacesM = 0.02;  // standard deviation of the places
constexpr int kPhotos = 7;

class BuildInMetres : public ::testing::Test {
 protected:
  void SetUp() override {
    const PinholeCamera camera(192, 128, 150, 150, 96, 64);
    for (const Pose& pose : CourtyardArc(kPhotos)) {
      photos_.push_back({fmt::format("{:04}.jpg", photos_.size()), camera, pose});
    }
    RenderCourtyard(folder_ / "plain", photos_);
    fs::create_directories(folder_ / "photos");
    Random random(9);
    for (const CourtyardPhoto& photo : photos_) {
      const double x = random.Normal(), y = random.Normal();
      WritePhotoAt(folder_ / "photos" / photo.name,
                   photo.cam_from_scene.TargetOriginInSource() + Eigen::Vector3d(25, 25, 0) +
                       kPlacesM * Eigen::Vector3d(x, y, random.Normal()),
                   {}, io::ReadImage(folder_ / "plain" / photo.name));
    }
    LeaveModel();
  }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  void LeaveModel() {
    calib::SfmModel model = CourtyardModel(photos_, 1 / kUnit);
    Random random(3);
    const std::vector<std::string> aliases = NumberImages(model);
    for (calib::SfmImage& image : model.images) {
      for (auto& feature : image.features) {
        const double x = random.Normal();
        feature.pixel += kNoisePx * Eigen::Vector2d(x, random.Normal());
      }
    }
    colmap::WriteModel(colmap_ / "model.0", model, colmap::Format::kBinary);
    colmap_.LeaveDatabase(aliases);
  }
  double Metres(size_t a, size_t b) const {
    return (photos_[a].cam_from_scene.TargetOriginInSource() -
            photos_[b].cam_from_scene.TargetOriginInSource())
        .norm();
  }
  Ran Build(std::vector<std::string> further) const {
    further.insert(further.begin(), {"build", In("photos"), "-o", In("set.dtr"), "--engine", "none",
                                     "--sfm", "colmap"});
    return Dtr(further);
  }
  colmap::testing::FakeColmap colmap_;
  TemporaryFolder folder_;
  std::vector<CourtyardPhoto> photos_;
};

TEST_F(BuildInMetres, GpsOfThePhotosGivesASetInMetres) {
  const Ran ran = Build({"--gps"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const DtrSet set = io::ReadSet(folder_ / "set.dtr");
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  const auto& views = set.frames.front().views;
  ASSERT_EQ(views.size(), photos_.size());
  for (size_t i = 1; i < views.size(); ++i) {
    // East, north and up are the scene's axes: each coordinate is the truth's.
    const Eigen::Vector3d way = views[i].CenterInWorld() - views[0].CenterInWorld();
    const Eigen::Vector3d truth = photos_[i].cam_from_scene.TargetOriginInSource() -
                                  photos_[0].cam_from_scene.TargetOriginInSource();
    EXPECT_LT((way - truth).norm(), 5 * kPlacesM) << i;
  }
  // Held places are no fault of the cameras: a fresh solve without them finds the same.
  const Json validation = Json::parse(set.validation_json);
  std::vector<std::string> passed;
  for (const Json& test : validation["tests"]) {
    if (test["passed"]) passed.push_back(test["name"]);
  }
  EXPECT_THAT(passed, IsSupersetOf({"camera_difference_sigmas", "lens_difference_sigmas"}));
  const Json provenance = Json::parse(set.provenance_json);
  const Json& scale = provenance["scale"][0];
  EXPECT_EQ(scale["method"], "gps");
  EXPECT_EQ(scale["photos"], kPhotos);
  EXPECT_NEAR(scale["metres_per_unit"], kUnit, 0.02 * kUnit);
  EXPECT_EQ(provenance["options"]["metres"]["gps"], true);
  EXPECT_EQ(provenance["calibration"]["bundle_adjustment"]["unit"], "metre");
}

TEST_F(BuildInMetres, ADistanceBetweenCamerasIsHeldByCalibratePhotos) {
  const std::string distance = fmt::format("0000,0006.jpg={:.9g}m+-1mm", Metres(0, 6));
  const Ran ran = Dtr({"calibrate", "photos", In("photos"), "-o", In("model"), "--sfm", "colmap",
                       "--distance", distance, "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_EQ(json["unit"], "metre");
  EXPECT_EQ(json["bundle_adjustment"]["scale"]["distances"][0]["text"], distance);
  const auto images = colmap::ReadModel(In("model")).images;
  const auto apart = [&](size_t a, size_t b) {
    return (images[a].cam_from_world.TargetOriginInSource() -
            images[b].cam_from_world.TargetOriginInSource())
        .norm();
  };
  EXPECT_NEAR(apart(0, 6), Metres(0, 6), 0.005);
  EXPECT_NEAR(apart(2, 4), Metres(2, 4), 0.01 * Metres(2, 4));
}

// Photos that structure from motion finds no camera for hold nothing.
TEST_F(BuildInMetres, TooFewCamerasForWhatIsKnownAreRejected) {
  calib::SfmModel model = colmap::ReadModel(colmap_ / "model.0");
  model.images.resize(3);
  std::erase_if(model.points, [&](const auto& item) {
    return std::none_of(model.images.begin(), model.images.end(), [&](const auto& image) {
      return std::any_of(image.features.begin(), image.features.end(),
                         [&](const auto& feature) { return feature.point_id == item.first; });
    });
  });
  fs::remove_all(colmap_ / "model.0");
  colmap::WriteModel(colmap_ / "model.0", model, colmap::Format::kBinary);
  ExpectRejected(
      Build({"--gps"}), kFailed,
      "--gps: expected at least 4 photos of those with a camera with latitude, longitude "
      "and altitude, found 3");
  fs::remove_all(folder_ / "set.dtr.partial");
  ExpectRejected(Build({"--distance", "0000,0006=1m"}), kFailed,
                 "--distance 0000,0006=1m: expected two photos that have a camera, found none of "
                 "0006");
}

// A wall faced squarely by a lens that nobody knows: with places or without, `calibrate photos`
// asks as `calibrate refine` does, before anything is refined.
TEST_F(BuildInMetres, PhotosThatDoNotDetermineTheirCamerasAreRejectedBeforeTheyAreRefined) {
  const calib::LensCamera lens{calib::CameraModel::kPinhole, 192, 128, {150, 150, 96, 64}};
  bundle::SceneSpec spec{.images = kPhotos, .points = 400, .lens = lens, .noise_px = 0.1};
  spec.pose = [](int i, int) {
    const Eigen::Vector3d centre(0.5 * (i % 3) - 0.5, -6, 0.5 * (i / 3));
    return bundle::LookAt(centre, centre + Eigen::Vector3d::UnitY());
  };
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2, 2);
    return Eigen::Vector3d(x, 0, random.Uniform(-1.5, 1.5));
  };
  calib::SfmModel model = ModelFrom(bundle::MakeBundle(spec));
  for (size_t i = 0; i < model.images.size(); ++i) {
    const std::string name = fmt::format("{:04}.jpg", i);
    WritePhotoAt(folder_ / "photos" / name,
                 model.images[i].cam_from_world.TargetOriginInSource() + Eigen::Vector3d(25, 25, 0),
                 {}, io::ReadImage(folder_ / "plain" / name));
    model.images[i].name = fmt::format("{:06}.jpg", i);
  }
  fs::remove_all(colmap_ / "model.0");
  colmap::WriteModel(colmap_ / "model.0", model, colmap::Format::kBinary);
  for (const std::vector<std::string>& how :
       {std::vector<std::string>{}, {"--gps"}, {"--no-refine"}}) {
    std::vector<std::string> words{"calibrate", "photos", In("photos"), "-o",
                                   In("model"), "--sfm",  "colmap"};
    words.insert(words.end(), how.begin(), how.end());
    const Ran ran = Dtr(words);
    ExpectRejected(ran, kFailed, "planar_scene: the points lie in a plane");
    EXPECT_THAT(ran.err, Not(HasSubstr("positions:"))) << "refined already";
    EXPECT_FALSE(fs::exists(folder_ / "model/cameras.bin"));
  }
}

TEST_F(BuildInMetres, WhatCannotBeHeldIsRejectedBeforeAnyWork) {
  ExpectRejected(Build({"--gps", "--no-refine"}), kWrongUsage,
                 "--gps, --distance: constrain the bundle adjustment of what SfM finds; expected "
                 "no --poses, --rig or --no-refine beside them");
  ExpectRejected(Build({"--distance", "0000,nobody=1m"}), kWrongUsage,
                 "--distance 0000,nobody=1m: no photo is named 'nobody'");
  ExpectRejected(
      Build({"--distance", "0000,0006=1m", "--holdout", "every:3", "--holdout-strict"}),
      kWrongUsage,
      "--distance 0000,0006=1m: expected photos that take part in bundle adjustment, found "
      "0000.jpg, which --holdout-strict keeps out of it");
  ExpectRejected(Build({"--gps", "--holdout", "0000,0001,0002,0003", "--holdout-strict"}), kFailed,
                 "expected at least 4 photos of those not held out strictly with latitude, "
                 "longitude and altitude, found 3");
  for (const CourtyardPhoto& photo : photos_) {
    WritePhotoAt(folder_ / "photos" / photo.name, Eigen::Vector3d(25, 25, 0), {},
                 io::ReadImage(folder_ / "plain" / photo.name));
  }
  ExpectRejected(Build({"--gps"}), kFailed,
                 "photos of the folder with GPS give the same latitude and longitude");
  for (const CourtyardPhoto& photo : photos_) fs::remove(folder_ / "photos" / photo.name);
  fs::copy(folder_ / "plain", folder_ / "photos", fs::copy_options::recursive);
  ExpectRejected(Build({"--gps"}), kFailed,
                 "expected at least 4 photos of the folder with latitude, longitude and altitude, "
                 "found 0");
  EXPECT_FALSE(fs::exists(folder_ / "set.dtr"));
  EXPECT_FALSE(fs::exists(folder_ / "set.dtr.partial"));
}

}  // namespace
}  // namespace dtr::testing
