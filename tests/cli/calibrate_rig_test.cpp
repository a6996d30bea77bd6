// `dtr calibrate rig`, and `dtr validate` of what it and `calibrate board` write, as users meet
// them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/cli/chessboard_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

const std::string kChessboard = "chessboard:9x6:25mm";

class CalibrateRig : public ChessboardSet {
 protected:
  Ran Rig(const std::string& photos, std::vector<std::string> further) {
    further.insert(further.begin(), {"calibrate", "rig", photos, "--board", kChessboard});
    return Dtr(further);
  }
  // The chessboard set's rig, once for all tests.
  static const Json& ChessboardRig() {
    static const Json json = [] {
      const TemporaryFolder folder;
      const std::string file = (folder / "rig.json").string();
      DtrCalibrated({"calibrate", "rig", Photos().string(), "--board", kChessboard, "--model", "brown4",
             "-o", file, "-o", (folder / "rig.yml").string()});
      Json both;
      both["json"] = Json::parse(Text(file));
      both["yml"] = Text(folder / "rig.yml");
      return both;
    }();
    return json;
  }
  std::string Write(const std::string& name, const Json& json) {
    WriteFileAtomically(folder_ / name, json.dump());
    return In(name);
  }
};

TEST_F(CalibrateRig, TheStereoSetGivesTwoCamerasAndTheirPlaces) {
  DTR_REQUIRE_DATA(Photos());
  const Json& json = ChessboardRig()["json"];
  ASSERT_EQ(json["cameras"].size(), 2u);
  EXPECT_EQ(json["views"].size(), 28u);
  EXPECT_FALSE(json["cameras"][0].contains("cam_from_rig"));
  const Json& right = json["cameras"][1];
  EXPECT_EQ(right["name"], "right");
  // OpenCV's stereoCalibrate: 3.34 squares apart, 0.205 px RMS with lenses fixed.
  EXPECT_NEAR(right["cam_from_rig"][0][3], -3.34 * 0.025, 0.001);
  EXPECT_EQ(right["place_covariance"].size(), 6u);
  for (const Json& camera : json["cameras"]) {
    EXPECT_GT(camera["rms_px"], 0.15);
    EXPECT_LT(camera["rms_px"], 0.25);
  }
  const std::string yml = ChessboardRig()["yml"];
  for (const char* name : {"M1:", "D1:", "M2:", "D2:", "R:", "T:"}) {
    EXPECT_THAT(yml, HasSubstr(name));
  }
}

TEST_F(CalibrateRig, ValidateTellsAnHonestRigFromASpoiledOne) {
  DTR_REQUIRE_DATA(Photos());
  const auto tests = [&](const std::string& file, int* code) {
    const Ran ran =
        Dtr({"validate", file, "--json", "-", "--report", In("report.html"), "--force"});
    EXPECT_TRUE(ran.code == 0 || ran.code == 1) << ran.err;
    *code = ran.code;
    const Json json = Json::parse(ran.out);
    EXPECT_EQ(json["passed"], ran.code == 0);
    std::map<std::string, Json> by_name;
    for (const Json& test : json["tests"]) by_name[test["name"]] = test;
    return by_name;
  };
  int code = 0;
  const auto honest = tests(Write("rig.json", ChessboardRig()["json"]), &code);
  for (const char* name :
       {"held_out_rms_px", "lens_difference_sigmas", "place_difference_sigmas", "rig_scale_sigmas",
        "boards_from_behind", "min_halves_p", "time_offset_sigmas", "rolling_shutter_px"}) {
    ASSERT_TRUE(honest.contains(name)) << name;
    EXPECT_TRUE(honest.at(name)["passed"]) << honest.at(name);
  }
  EXPECT_THAT(Text(folder_ / "report.html"), HasSubstr("held_out_rms_px"));

  Json longer = ChessboardRig()["json"];  // as if the squares were 3 % larger
  for (int i = 0; i < 3; ++i) {
    Json& shift = longer["cameras"][1]["cam_from_rig"][static_cast<size_t>(i)][3];
    shift = 1.03 * shift.get<double>();
  }
  const auto scaled = tests(Write("longer.json", longer), &code);
  EXPECT_EQ(code, kFailed);
  EXPECT_FALSE(scaled.at("rig_scale_sigmas")["passed"]);
  EXPECT_TRUE(scaled.at("lens_difference_sigmas")["passed"]);

  Json focal = ChessboardRig()["json"];
  for (const char* name : {"fx_px", "fy_px"}) {
    Json& f = focal["cameras"][0]["params"][name];
    f = 1.02 * f.get<double>();
  }
  const auto refocused = tests(Write("focal.json", focal), &code);
  EXPECT_EQ(code, kFailed);
  EXPECT_FALSE(refocused.at("lens_difference_sigmas")["passed"]);
  EXPECT_THAT(refocused.at("lens_difference_sigmas")["reason"].get<std::string>(),
              HasSubstr("left"));
}

TEST_F(CalibrateRig, ACalibrationThatKeepsNothingIsValidatedByPhotosOnly) {
  DTR_REQUIRE_DATA(Photos());
  Json bare = ChessboardRig()["json"];
  bare["views"] = Json::array();
  const std::string file = Write("bare.json", bare);
  ExpectRejected(Dtr({"validate", file}), kWrongUsage,
                 "has no observations; give photos of the board by --images");
  const Ran ran = Dtr({"validate", file, "--images", Photos().string(), "--json", "-"});
  EXPECT_TRUE(ran.code == 0 || ran.code == 1) << ran.err;
  const Json json = Json::parse(ran.out);
  EXPECT_EQ(json["tests"][0]["name"], "test_rms_px");
  EXPECT_LT(json["tests"][0]["value"], 0.3);
}

TEST_F(CalibrateRig, WhatIsNoRigIsSaidInOneLine) {
  const std::string photos = In("photos");
  fs::create_directory(photos);
  const std::vector<std::string> good{"-o", In("rig.json")};
  ExpectRejected(Rig(In("absent"), good), kWrongUsage,
                 "expected a folder of what the cameras of a rig saw, found nothing");
  const auto photo = [&](const std::string& name) {
    io::WriteImage(fs::path(photos) / name, ImageRgb8(320, 240, 3, 128));
  };
  photo("left01.png");
  ExpectRejected(Rig(photos, good), kWrongUsage, "expected at least 2 cameras");
  photo("right01.png");
  ExpectRejected(Rig(photos, good), kFailed, "camera left: expected photos of a");
  // One camera sees a time step once: which of the two would be the rig's?
  photo("left01.jpg");
  ExpectRejected(Rig(photos, good), kFailed,
                 "frame 01 of camera left: expected one image of every camera in a frame");
  EXPECT_FALSE(fs::exists(In("rig.json")));
}

}  // namespace
}  // namespace dtr::testing
