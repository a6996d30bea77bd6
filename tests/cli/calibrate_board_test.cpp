// `dtr calibrate board` as its users meet it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "calib/files/calibration.h"
#include "calib/files/opencv_yaml.h"
#include "dtr/io/image_io.h"
#include "tests/cli/chessboard_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

const std::string kChessboard = "chessboard:9x6:1";

class CalibrateBoard : public ChessboardSet {
 protected:
  Ran Board(const std::string& photos, std::vector<std::string> further) {
    further.insert(further.begin(), {"calibrate", "board", photos});
    return Dtr(further);
  }
};

TEST_F(CalibrateBoard, TheChessboardSetGivesOneCameraInThreeFormats) {
  DTR_REQUIRE_DATA(Photos());
  const Ran ran =
      Board(Photos(), {"--images", "left*.jpg", "--board", kChessboard, "-o", In("left.json"), "-o",
                       In("left.yml"), "-o", In("left.txt"), "--json", "-"});
  ASSERT_TRUE(IsDone(ran)) << ran.err;
  const Json json = Json::parse(ran.out);
  for (const char* name : {"board", "cameras", "views", "models", "left_out"}) {
    EXPECT_TRUE(json.contains(name)) << name;
  }
  EXPECT_EQ(json["views"].size(), 14u);
  EXPECT_EQ(json["models"].size(), 5u);
  // Every corner counted, OpenCV's own RMS is 0.187 px; held out, unseen photos are a little worse.
  EXPECT_NEAR(json["cameras"][0]["rms_px"], 0.187, 0.02);
  for (const Json& tried : json["models"]) {
    if (!tried["chosen"]) continue;
    EXPECT_GT(tried["held_out_rms_px"], 0.17);
    EXPECT_LT(tried["held_out_rms_px"], 0.23);
    EXPECT_LE(tried["difference_low_px"], 0);
  }
  const calib::Calibration calibration = calib::ReadCalibration(In("left.json"));
  ASSERT_EQ(calibration.cameras.size(), 1u);
  EXPECT_EQ(calibration.cameras[0].name, "left");
  const auto& params = calibration.cameras[0].camera.params;
  EXPECT_NEAR(params[0], 533, 2);
  EXPECT_NEAR(params[2], 342, 2);
  EXPECT_EQ(colmap::ReadCamerasText(In("left.txt")).at(1).params, params);
  const auto yaml = calib::ReadOpenCvYaml(In("left.yml"));
  EXPECT_EQ(yaml.width_px, 640);
  for (size_t i = 0; i < yaml.params.size(); ++i) EXPECT_NEAR(yaml.params[i], params[i], 1e-12);
}

TEST_F(CalibrateBoard, TheBytesDoNotDependOnThreads) {
  DTR_REQUIRE_DATA(Photos());
  for (const char* threads : {"1", "3"}) {
    const Ran ran = Board(Photos(), {"--images", "right0*.jpg", "--board", kChessboard, "-o",
                                     In(threads) + ".json", "--threads", threads});
    ASSERT_TRUE(IsDone(ran)) << ran.err;
  }
  std::string one = Text(In("1.json")), three = Text(In("3.json"));
  const size_t name = one.find("\"name\": \"1\"");  // the file's name is the camera's
  ASSERT_NE(name, std::string::npos);
  one[name + 9] = '3';
  EXPECT_EQ(one, three);
}

TEST_F(CalibrateBoard, TheTestsOfValidateEndItAndTheFilesAreThere) {
  DTR_REQUIRE_DATA(Photos());
  const Ran few = Board(Photos(), {"--images", "left0[1-5].jpg", "--board", kChessboard, "--model",
                                   "brown4", "-o", In("few.json"), "--json", "-"});
  EXPECT_EQ(few.code, kFailed) << few.err;
  EXPECT_TRUE(few.ErrorLines().empty()) << few.err;
  EXPECT_EQ(calib::ReadCalibration(In("few.json")).views.size(), 5u);
  const Json validation = Json::parse(few.out)["validation"];
  EXPECT_EQ(validation["passed"], false);
  EXPECT_EQ(validation["result"], "FAILED");
  const std::string conclusion = validation["conclusion"];
  EXPECT_THAT(conclusion, HasSubstr("min_views 5 (at least 8)"));
  EXPECT_TRUE(few.err.ends_with(conclusion + "\n")) << few.err;
  const Ran validated = Dtr({"validate", In("few.json"), "--json", "-"});
  EXPECT_EQ(validated.code, kFailed);
  EXPECT_EQ(Json::parse(validated.out)["conclusion"], conclusion);
}

TEST_F(CalibrateBoard, WhatCannotWorkIsSaidInOneLine) {
  const std::string photos = In("photos");
  fs::create_directory(photos);
  const std::vector<std::string> good{"--board", kChessboard, "-o", In("c.json")};
  ExpectRejected(Board(In("absent"), good), kWrongUsage, "expected a folder of photos of a board");
  ExpectRejected(Board(photos, good), kWrongUsage, "expected photos matching '*', found none");
  io::WriteImage(fs::path(photos) / "grey.png", ImageRgb8(320, 240, 3, 128));
  ExpectRejected(Board(photos, good), kFailed, "found it in none of 1");
  ExpectRejected(Board(photos, {"--board", "chess:9x6", "-o", In("c.json")}), kWrongUsage,
                 "unknown kind 'chess'");
  ExpectRejected(Board(photos, {"--board", kChessboard, "-o", In("c.xml")}), kWrongUsage,
                 "expected a name ending in .json or .yml or .yaml or .txt, found '.xml'");
  ExpectRejected(Board(photos, {"--board", kChessboard, "--model", "magic", "-o", In("c.json")}),
                 kWrongUsage, "--model magic: expected auto or the name of a model");
  EXPECT_FALSE(fs::exists(In("c.json")));
}

TEST_F(CalibrateBoard, ABoardOfAnotherSizeIsNamedBeforeAnythingIsSolved) {
  DTR_REQUIRE_DATA(Photos());
  const auto refused = [&](const std::string& given, const std::string& expected) {
    ExpectRejected(Board(Photos(), {"--images", "left*.jpg", "--board", given, "-o", In("c.json")}),
                   kWrongUsage, expected);
  };
  // Its corners lie on part of the board that is shown.
  refused("chessboard:8x6:1", "show a chessboard of 9x6 inner corners, none the given one");
  refused("chessboard:10x7:1", "give chessboard:9x6:SQUARE (you gave the number of squares)");
  EXPECT_FALSE(fs::exists(In("c.json")));
}

TEST_F(CalibrateBoard, TooFewPhotosAreRejected) {
  DTR_REQUIRE_DATA(Photos());
  const std::string two = In("two");
  fs::create_directory(two);
  for (const char* name : {"left01.jpg", "left02.jpg"}) {
    fs::copy_file(Photos() / name, fs::path(two) / name);
  }
  const std::vector<std::string> common{"--board", kChessboard, "-o", In("c.json")};
  ExpectRejected(Board(two, common), kFailed, "--model auto: expected at least 5 images");
  auto named = common;
  named.insert(named.end(), {"--model", "brown4"});
  ExpectRejected(Board(two, named), kFailed, "expected at least 3 images with the board, found 2");
  EXPECT_FALSE(fs::exists(In("c.json")));
}

}  // namespace
}  // namespace dtr::testing
