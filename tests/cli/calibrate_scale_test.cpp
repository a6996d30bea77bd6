// `dtr calibrate scale` as its users meet it: on a set whose true size is known.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kUnit = 2.5;  // metres that a unit of the set is

class CalibrateScale : public ::testing::Test {
 protected:
  // The courtyard, 2.5 times too small, away from zero.
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "courtyard", 1 / kUnit, {5e5, 4.5e6, 100});
    ImportSmallCourtyard(folder_ / "courtyard", folder_ / "small.dtr");
  }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  Ran Scale(std::vector<std::string> further) {
    further.insert(further.begin(), {"calibrate", "scale", In("small.dtr")});
    return Dtr(further);
  }
  // Distance in metres between the cameras of two views.
  double Metres(const DtrSet& set, size_t a, size_t b) const {
    const auto& views = set.frames[0].views;
    return kUnit * (views[a].CenterInWorld() - views[b].CenterInWorld()).norm();
  }
  TemporaryFolder folder_;
};

void ExpectScaled(const fs::path& before, const fs::path& after, double scale) {
  const DtrSet a = io::LoadSet(before, {.sigma = true}), b = io::LoadSet(after, {.sigma = true});
  EXPECT_EQ(b.unit, LengthUnit::kMetre);
  EXPECT_LT((b.world_origin - scale * a.world_origin).norm(), 1e-12 * b.world_origin.norm());
  EXPECT_LT((b.scene_center - scale * a.scene_center).norm(), 1e-9);
  EXPECT_LT((b.bounds.max - scale * a.bounds.max).norm(), 1e-9 * b.bounds.max.norm());
  ASSERT_EQ(a.frames[0].views.size(), b.frames[0].views.size());
  for (size_t i = 0; i < a.frames[0].views.size(); ++i) {
    const View &u = a.frames[0].views[i], &v = b.frames[0].views[i];
    EXPECT_LT((v.CenterInWorld() - scale * u.CenterInWorld()).norm(), 1e-9);
    EXPECT_NEAR(v.reference_baseline, scale * u.reference_baseline, 1e-9);
    EXPECT_EQ(u.image_file->sha256, v.image_file->sha256);
    ASSERT_EQ(u.depth.grid().data().size(), v.depth.grid().data().size());
    // Stored in 65534 steps of inverse depth: the same step, to rounding in the middle of two.
    const double step = (1 / v.near_z - 1 / v.far_z) / 65534;
    for (size_t k = 0; k < u.depth.grid().data().size(); ++k) {
      const float z = u.depth.grid().data()[k], scaled = v.depth.grid().data()[k];
      ASSERT_EQ(DepthImage::IsHole(z), DepthImage::IsHole(scaled));
      if (DepthImage::IsHole(z)) continue;
      ASSERT_LE(std::abs(1 / scaled - 1 / (scale * z)), 1.01 * step);
    }
  }
}

TEST_F(CalibrateScale, ADistanceBetweenCamerasMakesTheSetMetric) {
  const DtrSet set = io::ReadSet(folder_ / "small.dtr");
  const auto& views = set.frames[0].views;
  const Ran ran = Scale({"--distance",
                         fmt::format("{},{}={:.17g}m", views[0].id, views[5].id, Metres(set, 0, 5)),
                         "-o", In("metric.dtr"), "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_NEAR(json["metres_per_unit"], kUnit, 1e-9);
  EXPECT_EQ(json["unit"], "metre");
  ExpectScaled(folder_ / "small.dtr", folder_ / "metric.dtr", kUnit);
  const DtrSet metric = io::ReadSet(folder_ / "metric.dtr");
  EXPECT_NEAR(Json::parse(metric.provenance_json)["scale"][0]["metres_per_unit"], kUnit, 1e-9);
  EXPECT_TRUE(io::VerifySet(folder_ / "metric.dtr").empty());
}

TEST_F(CalibrateScale, PixelsWithDepthAndPixelsOfTwoViewsAgreeWithTheTruth) {
  const DtrSet set = io::LoadSet(folder_ / "small.dtr");
  const View& a = set.frames[0].views[1];
  const auto point = [&](int x, int y) {
    return Eigen::Vector3d(a.cam_from_world.Inverse() * a.camera.CamFromPixel({x + 0.5, y + 0.5},
                                                                              a.depth(x, y),
                                                                              DepthKind::kPlaneZ));
  };
  const Eigen::Vector3d p = point(90, 70), q = point(40, 110);
  const double metres = kUnit * (p - q).norm();
  // Clicked in every view that has it on its image: two of these small images say too little.
  const auto in_all = [&](const Eigen::Vector3d& x) {
    std::string clicks;
    for (const View& view : set.frames[0].views) {
      const auto pixel = view.camera.PixelFromCam(view.cam_from_world * x);
      if (!pixel || !view.camera.Contains(*pixel)) continue;
      clicks += fmt::format("{}{}:{:.4f}:{:.4f}", clicks.empty() ? "" : "+", view.id, pixel->x(),
                            pixel->y());
    }
    return clicks;
  };
  const std::string by_depth =
      fmt::format("{}:90.5:70.5,{}:40.5:110.5={:.9g}m+-1mm", a.id, a.id, metres);
  const std::string by_rays = fmt::format("{},{}={:.9g}m", in_all(p), in_all(q), metres);
  const Ran ran =
      Scale({"--distance", by_depth, "--distance", by_rays, "-o", In("metric.dtr"), "--json", "-"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_NEAR(json["metres_per_unit"], kUnit, 1e-3);
  EXPECT_GT(json["relative_sigma"], 1e-4);
  EXPECT_LT(json["relative_sigma"], 0.1);
}

TEST_F(CalibrateScale, InPlaceTheSetIsReplaced) {
  fs::copy(folder_ / "small.dtr", folder_ / "old.dtr", fs::copy_options::recursive);
  const DtrSet set = io::ReadSet(folder_ / "small.dtr");
  const auto& views = set.frames[0].views;
  const Ran ran = Scale(
      {"--distance", fmt::format("{},{}={:.17g}m", views[0].id, views[5].id, Metres(set, 0, 5))});
  ASSERT_EQ(ran.code, 0) << ran.err;
  ExpectScaled(folder_ / "old.dtr", folder_ / "small.dtr", kUnit);
}

TEST_F(CalibrateScale, AViewThatOnlyItsExtensionTellsIsNamedInFull) {
  Json set = Json::parse(Text(folder_ / "small.dtr/set.json"));
  Json& views = set["frames"][0]["views"];
  views[1]["name"] = "a/IMG.jpg";
  views[2]["name"] = "a/IMG.png";
  WriteFileAtomically(folder_ / "small.dtr/set.json", set.dump());
  ExpectRejected(Scale({"--distance", "a/IMG,0005=5m"}), kWrongUsage,
                 "'a/IMG' may be a/IMG.jpg or a/IMG.png; name the photo with its extension");
  EXPECT_EQ(Scale({"--distance", "a/IMG.png,0005=5m"}).code, 0);
}

TEST_F(CalibrateScale, WhatSaysNothingIsRejected) {
  const auto before = Contents(folder_ / "small.dtr");
  ExpectRejected(Scale({}), kWrongUsage,
                 "expected --distance (once or more), --board or --gps, found none of them");
  ExpectRejected(Scale({"--distance", "0000,0001"}), kWrongUsage, "found no '='");
  ExpectRejected(Scale({"--distance", "0000,0001=5"}), kWrongUsage, "no length is '5'");
  ExpectRejected(Scale({"--distance", "0000:x:1,0001=5m"}), kWrongUsage, "no pixel is 'x:1'");
  ExpectRejected(Scale({"--distance", "0001:1e5:1,0002=5m"}), kWrongUsage,
                 "expected a pixel of the 192 x 128 of view");
  ExpectRejected(Scale({"--distance", "0001,0001=5m"}), kFailed,
                 "expected points whose distance is known to 10 %, found 0 +- 0 units");
  ExpectRejected(Scale({"--distance", "0001:90:70+0002:10:10,0001=5m"}), kFailed,
                 "expected the same point in every view");
  ExpectRejected(Scale({"--gps", In("courtyard/images")}), kFailed,
                 "expected at least 4 photos of the set with latitude, longitude and altitude, "
                 "found 0");
  EXPECT_TRUE(DifferingFiles(before, Contents(folder_ / "small.dtr")).empty());
}

}  // namespace
}  // namespace dtr::testing
