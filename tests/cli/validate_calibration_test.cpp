// `dtr validate CALIB --images`: which photos count as unseen, and cameras from elsewhere.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "pipeline/core/photos/rig_names.h"
#include "tests/cli/chessboard_set.h"

namespace dtr::testing {
namespace {

using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kChessboard = "chessboard:9x6:1";

class ValidateCalibration : public ChessboardSet {
 protected:
  // The left camera by its first nine photos; 10 to 14 are unseen.
  void Calibrate() {
    DtrCalibrated({"calibrate", "board", Photos().string(), "--images", "left0*.jpg", "--board",
                   kChessboard, "--model", "brown4", "-o", In("left.json"), "-o", In("left.yml"),
                   "-o", In("left.txt")});
  }
  Ran Validate(const std::string& file, std::vector<std::string> further) {
    further.insert(further.begin(), {"validate", In(file)});
    return Dtr(further);
  }
};

TEST_F(ValidateCalibration, PhotosThatItWasMadeFromAreNotUnseenAndAreNamed) {
  DTR_REQUIRE_DATA(Photos());
  Calibrate();
  const Ran ran = Validate(
      "left.json", {"--images", Photos().string(), "--pattern", "left*.jpg", "--json", "-"});
  ASSERT_TRUE(ran.code == 0 || ran.code == kFailed) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("left out: left01.jpg: not held out: its corners are those of "
                                 "left01.jpg"));
  EXPECT_THAT(ran.err, Not(HasSubstr("left out: left11.jpg")));
  const Json json = Json::parse(ran.out);
  const Json& views = json["cameras"][0]["views"];
  EXPECT_EQ(views.size(), 5u);
  for (const Json& view : views) EXPECT_THAT(view["name"], HasSubstr("left1"));
  ExpectRejected(
      Validate("left.json", {"--images", Photos().string(), "--pattern", "left0*.jpg"}), kFailed,
      "expected photos that the calibration has not seen, found only those that it was made from");
}

TEST_F(ValidateCalibration, ACameraFromElsewhereIsValidatedByPhotosOfABoard) {
  DTR_REQUIRE_DATA(Photos());
  Calibrate();
  std::map<std::string, double> rms_px;
  for (const char* file : {"left.yml", "left.txt"}) {
    ExpectRejected(Validate(file, {"--images", Photos().string()}), kWrongUsage,
                   "has neither board nor observations; expected --board BOARD and --images DIR");
    const Ran ran = Validate(file, {"--images", Photos().string(), "--pattern", "left*.jpg",
                                    "--board", kChessboard, "--json", "-"});
    ASSERT_TRUE(ran.code == 0 || ran.code == kFailed) << ran.err;
    const Json json = Json::parse(ran.out);
    EXPECT_EQ(json["cameras"][0]["views"].size(), 14u);
    for (const Json& test : json["tests"]) {
      if (test["name"] == "test_rms_px") {
        rms_px[file] = test["value"];
      }
      // The right camera, or another focal length, would be hundreds of sigmas off.
      if (test["name"] == "lens_difference_sigmas") {
        ASSERT_TRUE(test["value"].is_number()) << test["reason"];
        EXPECT_LT(test["value"], 30);
      }
    }
  }
  ASSERT_EQ(rms_px.size(), 2u);
  EXPECT_LT(rms_px["left.yml"], 0.3);
  EXPECT_NEAR(rms_px["left.yml"], rms_px["left.txt"], 1e-6);  // half a pixel would be 0.7 px
}

// What errs in one direction grows with 1/distance up close and stays what it is far away.
TEST_F(ValidateCalibration, UncertaintyIsToldAtChosenDistances) {
  DTR_REQUIRE_DATA(Photos());
  Calibrate();
  const Ran ran = Validate("left.json", {"--at", "15,200,20000", "--json", "-"});
  ASSERT_TRUE(ran.code == 0 || ran.code == kFailed) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("at 200 (the squares' unit): standard deviation of a projection"));
  const Json camera = Json::parse(ran.out)["cameras"][0];
  ASSERT_EQ(camera["uncertainty_at"].size(), 3u);
  EXPECT_EQ(camera["uncertainty_at"][0]["distance"], 15.0);
  const auto p95 = [&](size_t i) { return camera["uncertainty_at"][i]["p95"].get<double>(); };
  EXPECT_GT(p95(0), 0);
  EXPECT_GT(p95(1), p95(0)) << "the boards stood some 15 away";
  EXPECT_NEAR(p95(2), camera["far_uncertainty_px"]["p95"].get<double>(), 0.02 * p95(2));
  ExpectRejected(Validate("left.json", {"--at", "2m"}), kWrongUsage,
                 "--at 2m: the board's squares have no unit");
  ExpectRejected(Validate("left.json", {"--at", "0"}), kWrongUsage,
                 "--at: expected distances above 0, as 2m or 60cm, found '0'");
}

TEST_F(ValidateCalibration, OptionsThatDoNotBelongTogetherAreRejected) {
  DTR_REQUIRE_DATA(Photos());
  Calibrate();
  ExpectRejected(Validate("left.json", {"--pattern", "left*.jpg"}), kWrongUsage,
                 "--pattern: says which photos of --images DIR; expected that, too");
  ExpectRejected(Validate("left.json", {"--images", Photos().string(), "--board", kChessboard}),
                 kWrongUsage, "says which board it was made from");
  ExpectRejected(Validate("left.json", {"--max-cross", "1"}), kWrongUsage,
                 "--max-cross: is for sets, not for calibration files");
}

TEST(FrameTimes, AMissingNumberIsAGapAndPlacesAreForOtherNames) {
  using Times = std::vector<size_t>;
  EXPECT_EQ(pipeline::FrameTimes({"0012", "0013", "0015"}), (Times{0, 1, 3}));
  EXPECT_EQ(pipeline::FrameTimes({"shot0", "shot10", "shot40"}), (Times{0, 1, 4}));
  EXPECT_EQ(pipeline::FrameTimes({"a1", "b2", "b3"}), (Times{0, 1, 2}));
  EXPECT_EQ(pipeline::FrameTimes({"one", "three", "two"}), (Times{0, 1, 2}));
  // The time of day is no count of frames.
  EXPECT_EQ(pipeline::FrameTimes({"1700000000", "1700000033", "1700001000"}), (Times{0, 1, 2}));
  EXPECT_EQ(pipeline::FrameTimes({"7"}), (Times{0}));
  EXPECT_TRUE(pipeline::FrameTimes({}).empty());
}

}  // namespace
}  // namespace dtr::testing
