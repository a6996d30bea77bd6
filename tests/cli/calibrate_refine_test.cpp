// `dtr calibrate refine` as its users meet it: models that cannot be refined, rejected by name; GPS
// and distances that are held.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calib/colmap/model_io.h"
#include "pipeline/core/metres.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/cli/gps_photo.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

const calib::LensCamera kLens{calib::CameraModel::kPinhole, 1000, 800, {900, 905, 504, 397}};

TEST(CalibrateRefine, DegenerateModelsAreRejectedByName) {
  const TemporaryFolder folder;
  const auto refine = [&](const std::string& name, const bundle::SceneSpec& spec) {
    const std::string model = (folder / name).string();
    colmap::WriteModel(model, ModelFrom(bundle::MakeBundle(spec)), colmap::Format::kBinary);
    return Dtr({"calibrate", "refine", model, "-o", model + "-out"});
  };
  bundle::SceneSpec spec{.images = 6, .points = 300, .lens = kLens, .noise_px = 0.3};
  EXPECT_EQ(refine("good", spec).code, 0);
  spec.pose = [](int i, int) {
    return bundle::LookAt({0, -6, 1}, {0.4 * i - 1, 0, 0.2 * (i % 3)});
  };
  ExpectRejected(refine("turning", spec), kFailed,
                 ": pure_rotation: half the points have a parallax");
  EXPECT_EQ(FilesIn(folder / "turning-out"), 0) << "nothing that means nothing is left";
  spec.pose = [](int i, int) {  // a wall faced squarely: focal length and distance are one
    const Eigen::Vector3d centre(0.5 * (i % 3) - 0.5, -6, 0.5 * (i / 3));
    return bundle::LookAt(centre, centre + Eigen::Vector3d::UnitY());
  };
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2, 2);
    return Eigen::Vector3d(x, 0, random.Uniform(-1.5, 1.5));
  };
  ExpectRejected(refine("wall", spec), kFailed, ": planar_scene: the points lie in a plane");
}

using Json = nlohmann::json;
using ::testing::HasSubstr;

// Errors of heavy tails: many observations lie at the limit of what is an outlier.
TEST(CalibrateRefine, OutliersThatDoNotSettleAreTold) {
  const TemporaryFolder folder;
  calib::Bundle bundle = bundle::MakeBundle({.images = 8, .points = 600, .lens = kLens});
  Random random(7);
  for (calib::BundleObservation& observation : bundle.observations) {
    const double x = random.Normal(), y = random.Normal();
    observation.pixel += 0.3 * Eigen::Vector2d(x, y) / std::abs(random.Normal());
  }
  const calib::SfmModel model = ModelFrom(bundle);
  colmap::WriteModel(folder / "model", model, colmap::Format::kBinary);
  // With a distance the result is taken whether or not it is better.
  const double length_m = (model.images[0].cam_from_world.TargetOriginInSource() -
                           model.images[7].cam_from_world.TargetOriginInSource())
                              .norm();
  const Ran ran =
      Dtr({"calibrate", "refine", (folder / "model").string(), "-o", (folder / "out").string(),
           "--distance", fmt::format("image100,image107={}m+-5cm", length_m), "--json",
           (folder / "told.json").string()});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(Text(folder / "told.json"));
  ASSERT_EQ(json["refined"], true) << json;
  ASSERT_GT(json["unsettled_observations"], 0) << "settled: the test tells nothing";
  EXPECT_THAT(ran.out, HasSubstr(fmt::format(
                           "which observations are outliers did not settle: {} of "
                           "{} would change with another solve",
                           json["unsettled_observations"].get<int>(), bundle.observations.size())));
}

constexpr double kUnit = 2.5;  // metres that a unit of the model is

// Eight photos around a box, their model in another world, their places in photos/.
class RefineToPlaces : public ::testing::Test {
 protected:
  void SetUp() override {
    calib::Bundle bundle = bundle::MakeBundle({.points = 400, .noise_px = 0.3});
    Random random(5);
    std::filesystem::create_directories(folder_ / "photos");
    for (calib::BundleImage& image : bundle.images) {
      image.name += ".jpg";
      // North and east of the origin: no seconds below zero.
      centres_.push_back(image.cam_from_world.TargetOriginInSource() + Eigen::Vector3d(20, 30, 0));
      const double x = random.Normal(), y = random.Normal();
      WritePhotoAt(folder_ / "photos" / image.name,
                   centres_.back() + 0.02 * Eigen::Vector3d(x, y, random.Normal()));
    }
    const calib::Similarity world{
        1 / kUnit, Eigen::Quaterniond(0.8, 0.2, -0.4, 0.4).normalized(), {5, -7, 90}};
    const calib::Bundle moved = bundle::Moved(bundle, world);
    colmap::WriteModel(In("model"), ModelFrom(moved), colmap::Format::kBinary);
  }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  Ran Refine(std::vector<std::string> further) const {
    further.insert(further.begin(), {"calibrate", "refine", In("model"), "-o", In("out")});
    return Dtr(further);
  }
  double Metres(size_t a, size_t b) const { return (centres_[a] - centres_[b]).norm(); }
  // Between cameras of what was written.
  double Found(size_t a, size_t b) const {
    const auto images = colmap::ReadModel(In("out")).images;
    return (images[a].cam_from_world.TargetOriginInSource() -
            images[b].cam_from_world.TargetOriginInSource())
        .norm();
  }
  TemporaryFolder folder_;
  std::vector<Eigen::Vector3d> centres_;  // true ones, metres
};

TEST_F(RefineToPlaces, GpsGivesMetresEastNorthAndUp) {
  const Ran ran = Refine({"--gps", In("photos"), "--covariance", "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_EQ(json["unit"], "metre");
  const Json& scale = json["scale"];
  EXPECT_EQ(scale["method"], "gps");
  EXPECT_EQ(scale["photos"], 8);
  EXPECT_TRUE(scale["left_out"].empty());
  EXPECT_NEAR(scale["metres_per_unit"], kUnit, 0.02 * kUnit);
  EXPECT_LT(scale["rms_m"], 0.06);
  EXPECT_NEAR(scale["origin"]["altitude_m"], 38, 0.2);
  EXPECT_EQ(json["covariance"]["gauge_freedom"], 0);
  const auto images = colmap::ReadModel(In("out")).images;
  for (size_t i = 0; i < images.size(); ++i) {
    const Eigen::Vector3d way = images[i].cam_from_world.TargetOriginInSource() -
                                images[0].cam_from_world.TargetOriginInSource();
    EXPECT_LT((way - (centres_[i] - centres_[0])).norm(), 0.15) << i;
  }
}

// As where a photo without a fix says latitude 0: east, north and up there are not those of the
// scene.
TEST_F(RefineToPlaces, AxesAreOfAPlaceThatLiesWhereMostDo) {
  WritePhotoAt(folder_ / "photos/image100.jpg", {0, 600e3, 0});
  const Ran ran = Refine({"--gps", In("photos"), "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json scale = Json::parse(ran.out)["scale"];
  EXPECT_EQ(scale["left_out"], Json::array({"image100.jpg"}));
  EXPECT_NEAR(scale["origin"]["latitude_deg"], 55.7, 1e-3);
  const auto images = colmap::ReadModel(In("out")).images;
  for (size_t i = 2; i < images.size(); ++i) {
    const Eigen::Vector3d way = images[i].cam_from_world.TargetOriginInSource() -
                                images[1].cam_from_world.TargetOriginInSource();
    EXPECT_LT((way - (centres_[i] - centres_[1])).norm(), 0.15) << i;
  }
}

TEST_F(RefineToPlaces, APlaceThatIsWrongIsNamedAndOthersMayBeMissing) {
  const std::string wrong = "image104.jpg";
  WritePhotoAt(folder_ / "photos" / wrong, centres_[4] + Eigen::Vector3d(25, 0, 0));
  std::filesystem::remove(folder_ / "photos/image106.jpg");
  const Ran ran = Refine({"--gps", In("photos")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("do not agree, left out: " + wrong));
  EXPECT_THAT(ran.out, HasSubstr("not in the folder: image106.jpg"));
  EXPECT_NEAR(Found(0, 7), Metres(0, 7), 0.1);
  EXPECT_NEAR(Found(3, 4), Metres(3, 4), 0.1);
}

TEST_F(RefineToPlaces, WhatExifOrTheUserSaysOfTheErrorIsTaken) {
  for (size_t i = 0; i < centres_.size(); ++i) {
    WritePhotoAt(folder_ / fmt::format("photos/image{}.jpg", 100 + i), centres_[i], 1.5);
  }
  // Such places do not tell the scale of so small a scene; a distance beside them does.
  const std::string distance = fmt::format("image100,image107={:.9g}m", Metres(0, 7));
  Ran ran = Refine({"--gps", In("photos"), "--distance", distance, "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  Json scale = Json::parse(ran.out)["scale"];
  EXPECT_EQ(scale["method"], "gps and distance");
  EXPECT_TRUE(scale["found_sigma_flat_m"].is_null()) << "EXIF says it";
  EXPECT_GT(scale["found_sigma_up_m"], 0) << "EXIF does not";
  EXPECT_NEAR(scale["relative_sigma"], 1e-3, 1e-4);
  EXPECT_EQ(scale["places_tell_scale"], false);
  std::filesystem::remove_all(folder_ / "out");
  for (size_t i = 1; i < centres_.size(); ++i) {
    WritePhotoAt(folder_ / fmt::format("photos/image{}.jpg", 100 + i), centres_[i], 0.2);
  }
  ran = Refine({"--gps", In("photos"), "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  scale = Json::parse(ran.out)["scale"];
  EXPECT_NEAR(scale["relative_sigma"], 0.02, 0.01)
      << "a vague position takes nothing from the others";
  std::filesystem::remove_all(folder_ / "out");
  ran = Refine({"--gps", In("photos"), "--gps-sigma", "0.1,0.2", "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  scale = Json::parse(ran.out)["scale"];
  EXPECT_TRUE(scale["found_sigma_flat_m"].is_null());
  EXPECT_TRUE(scale["found_sigma_up_m"].is_null());
  // Of 0.14 m per coordinate over eight cameras some 3 m from their middle.
  EXPECT_NEAR(scale["relative_sigma"], 0.02, 0.007);
}

TEST_F(RefineToPlaces, ADistanceSetsTheUnit) {
  const Ran ran = Refine({"--distance", fmt::format("image100,image107.jpg={:.9g}m", Metres(0, 7)),
                          "--covariance", "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_EQ(json["unit"], "metre");
  EXPECT_EQ(json["scale"]["method"], "distance");
  EXPECT_NEAR(json["scale"]["metres_per_unit"], kUnit, 1e-2 * kUnit);
  EXPECT_NEAR(json["scale"]["distances"][0]["found_m"], Metres(0, 7), 1e-3 * Metres(0, 7));
  EXPECT_EQ(json["covariance"]["gauge_freedom"], 6);
  EXPECT_NEAR(Found(0, 7), Metres(0, 7), 1e-3 * Metres(0, 7));
  EXPECT_NEAR(Found(2, 5), Metres(2, 5), 0.01 * Metres(2, 5));
}

// Places that err by more than tells the scale: a distance does, and they turn and shift the whole.
TEST_F(RefineToPlaces, VaguePlacesTurnWhatADistanceScalesAndAreRejectedWithoutOne) {
  Random random(11);
  for (size_t i = 0; i < centres_.size(); ++i) {
    const double x = random.Normal(), y = random.Normal();
    WritePhotoAt(folder_ / fmt::format("photos/image{}.jpg", 100 + i),
                 centres_[i] + 1.5 * Eigen::Vector3d(x, y, random.Normal()));
  }
  ExpectRejected(Refine({"--gps", In("photos")}), kFailed,
                 "scale: expected a scale known to 10 %, found one to ");
  const Ran ran =
      Refine({"--gps", In("photos"), "--distance",
              fmt::format("image100,image107={:.9g}m", Metres(0, 7)), "--json", In("told.json")});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("it is that of the distances"));
  EXPECT_THAT(ran.out,
              HasSubstr("the positions err too much for cameras that stand so near to each "
                        "other: the rotation, and with it what is north and up, is known to"));
  const Json scale = Json::parse(Text(In("told.json")))["scale"];
  EXPECT_EQ(scale["places_tell_scale"], false);
  EXPECT_GT(scale["places_relative_sigma"], 0.1);
  EXPECT_NEAR(scale["relative_sigma"], 1e-3, 1e-4);
  EXPECT_NEAR(Found(2, 5), Metres(2, 5), 0.01 * Metres(2, 5));
  // The axes are those of the Earth as far as such places tell them.
  const auto images = colmap::ReadModel(In("out")).images;
  const double turn_rad = scale["turn_sigma_deg"].get<double>() * std::numbers::pi / 180;
  for (size_t i = 1; i < images.size(); ++i) {
    const Eigen::Vector3d way = images[i].cam_from_world.TargetOriginInSource() -
                                images[0].cam_from_world.TargetOriginInSource();
    EXPECT_LT((way - (centres_[i] - centres_[0])).norm(), 3 * turn_rad * way.norm()) << i;
  }
}

TEST_F(RefineToPlaces, PlacesThatTellNothingAreRejected) {
  for (size_t i = 5; i < centres_.size(); ++i) {
    std::filesystem::remove(folder_ / fmt::format("photos/image{}.jpg", 100 + i));
  }
  // Two that claim to err by millimetres, and err by decimetres.
  for (size_t i = 0; i < 5; ++i) {
    const Eigen::Vector3d off = i < 3 ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(0.2, 0.2, 0);
    WritePhotoAt(folder_ / fmt::format("photos/image{}.jpg", 100 + i), centres_[i] + off,
                 i < 3 ? 0.3 : 0.003);
  }
  ExpectRejected(Refine({"--gps", In("photos")}), kFailed,
                 "GPS: expected positions that agree with the cameras, found that 3 of 5 do");
  for (size_t i = 0; i < 5; ++i) {
    WritePhotoAt(folder_ / fmt::format("photos/image{}.jpg", 100 + i), {20, 30, 0});
  }
  ExpectRejected(Refine({"--gps", In("photos")}), kFailed,
                 "photos of the model with GPS give the same latitude and longitude");
}

// EXIF says a radius, of which 68 % is taken to lie within.
TEST_F(RefineToPlaces, TheErrorThatExifSaysIsARadius) {
  for (size_t i = 0; i < centres_.size(); ++i) {
    WritePhotoAt(folder_ / fmt::format("photos/image{}.jpg", 100 + i), centres_[i], 0.3);
  }
  const calib::SfmModel model = colmap::ReadModel(In("model"));
  pipeline::MetreOptions options;
  options.gps = true;
  const auto refined = pipeline::RefineInMetres(
      model, options, pipeline::ReadPhotoPositions(folder_ / "photos", calib::ImageNames(model)),
      {});
  ASSERT_EQ(refined.start.options.positions.size(), centres_.size());
  for (const calib::PositionPrior& p : refined.start.options.positions) {
    EXPECT_NEAR(p.sigma.x(), 0.3 / 1.50959, 1e-4);
    EXPECT_EQ(p.sigma.y(), p.sigma.x());
  }
}

TEST_F(RefineToPlaces, PlacesThatDoNotSettleAreTold) {
  pipeline::MetreOptions options;
  options.gps = true;
  const calib::SfmModel model = colmap::ReadModel(In("model"));
  const auto places = pipeline::ReadPhotoPositions(folder_ / "photos", calib::ImageNames(model));
  const auto told = [&](int max_passes) {
    options.max_passes = max_passes;
    const auto refined = pipeline::RefineInMetres(model, options, places, {});
    const pipeline::PositionsReport& positions = refined.report.positions.value();
    EXPECT_LE(positions.passes, max_passes);
    const std::string line = fmt::format(
        "which positions agree, and how far they err, did not settle in {} passes; give "
        "`gps_sigma` "
        "where you know it",
        max_passes);
    const auto& lines = refined.lines;
    EXPECT_EQ(std::find(lines.begin(), lines.end(), line) != lines.end(), !positions.settled);
    return positions.settled;
  };
  EXPECT_TRUE(told(10));
  EXPECT_FALSE(told(1)) << "settled at once: the test tells nothing";
}

TEST_F(RefineToPlaces, AWordThatTwoPhotosMayBeMeantByIsRejected) {
  calib::SfmModel model = colmap::ReadModel(In("model"));
  model.images[5].name = "image104.png";
  std::filesystem::remove_all(In("model"));
  colmap::WriteModel(In("model"), model, colmap::Format::kBinary);
  ExpectRejected(Refine({"--distance", "image100,image104=5m"}), kWrongUsage,
                 "--distance image100,image104=5m: 'image104' may be image104.jpg or image104.png; "
                 "name the photo with its extension");
  const auto distance = fmt::format("image100,image104.png={:.9g}m", Metres(0, 5));
  const Ran ran = Refine({"--distance", distance});
  EXPECT_EQ(ran.code, 0) << ran.err;
}

TEST_F(RefineToPlaces, WhatCannotBeHeldIsRejected) {
  const auto distance = [&](const std::string& text) { return Refine({"--distance", text}); };
  ExpectRejected(distance("image100:1:2,image101=5m"), kWrongUsage,
                 "expected two photos, as left01,right01=12cm, found 'image100:1:2'");
  ExpectRejected(distance("image100:x:2,image101=5m"), kWrongUsage,
                 "expected two photos, as left01,right01=12cm, found 'image100:x:2'");
  ExpectRejected(distance("image100,image101=5"), kWrongUsage,
                 "no length is '5'; expected A,B=LENGTH, as left01,right01=12cm: A and B each a "
                 "photo, whose camera is meant, LENGTH in mm, cm or m");
  ExpectRejected(Refine({"--gps", In("photos"), "--gps-sigma", ""}), kWrongUsage,
                 "--gps-sigma : expected metres above 0, as 3 or 3,6 (on the map, in height)");
  ExpectRejected(distance("nobody,image101=5m"), kWrongUsage, "no photo is named 'nobody'");
  ExpectRejected(distance("image100,image100=5m"), kWrongUsage,
                 "expected two photos, found 'image100' twice");
  ExpectRejected(distance("image100,image101"), kWrongUsage, "found no '='");
  ExpectRejected(Refine({"--gps", In("photos"), "--gps-sigma", "0"}), kWrongUsage,
                 "--gps-sigma 0: expected metres above 0, as 3 or 3,6 (on the map, in height)");
  ExpectRejected(
      Refine({"--gps", In("photos"), "--gps-sigma", "5"}), kFailed,
      "expected positions or distances that determine the scale to 10 %, found ones that determine "
      "it to ");
  ExpectRejected(Refine({"--gps-sigma", "3"}), kWrongUsage, "--gps-sigma requires --gps");
  std::filesystem::create_directories(folder_ / "empty");
  ExpectRejected(Refine({"--gps", In("empty")}), kFailed,
                 "expected at least 4 photos of the model with latitude, longitude and altitude, "
                 "found 0");
  ExpectRejected(Refine({"--gps", In("photos"), "--distance", "image100,image107=1m"}), kFailed,
                 "expected a distance that agrees with the photos' GPS, found ");
  ExpectRejected(
      Refine({"--distance", "image100,image107=8m", "--distance", "image101,image106=9m"}), kFailed,
      "expected distances that agree, found ");
  // Too little for a model that is bent, too much for these photos.
  const std::string one = fmt::format("image100,image107={:.9g}m", Metres(0, 7));
  const std::string other = fmt::format("image101,image106={:.9g}m", 1.05 * Metres(1, 6));
  ExpectRejected(Refine({"--distance", one, "--distance", other}), kFailed,
                 "expected a distance that the photos agree with, found ");
  EXPECT_EQ(FilesIn(folder_ / "out"), 0);
}

}  // namespace
}  // namespace dtr::testing
