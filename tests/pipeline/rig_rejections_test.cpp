// Reasons for which the intrinsics and photos of a rig are rejected: the words of the lines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "pipeline/boards/calibrate_rig.h"
#include "pipeline/boards/validate_calibration.h"
#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const calib::LensCamera kLens{calib::CameraModel::kPinhole, 64, 48, {60, 60, 32, 24}};

calib::Calibration CalibrationOf(const std::vector<std::string>& cameras) {
  calib::Calibration calibration;
  calibration.board = calib::BoardFromText("chessboard:9x6:25mm");
  for (const std::string& name : cameras) {
    calibration.cameras.push_back({name, calib::BoardModel::kPinhole, kLens, {}});
  }
  return calibration;
}

class GivenLenses : public ::testing::Test {
 protected:
  // Two cameras, of which those named have a lens.
  void Calibrate(const std::vector<std::string>& names, const calib::LensCamera& lens = kLens) {
    RigPhotos photos;
    photos.cameras = {{"left", 64, 48}, {"right", 64, 48}};
    RigCalibrationOptions options;
    for (const std::string& name : names) options.given[name] = GivenLens(lens, "lens.txt");
    RigSummary summary;
    SilentProgress nobody;
    CalibrateRig(CalibrationOf({}).board, photos, options, &summary, nobody);
  }
};

TEST_F(GivenLenses, AreOfEveryCameraAndOfNoOther) {
  EXPECT_THAT(
      [&] { Calibrate({"left"}); },
      ThrowsMessage<UsageError>(HasSubstr(
          "`camera`: expected intrinsics for every camera or for none, found none for right")));
  EXPECT_THAT(
      [&] {
        Calibrate({"left", "middle", "right"});
      },
      ThrowsMessage<UsageError>(
          HasSubstr("`camera` middle: no such camera; the first one is left")));
}

TEST_F(GivenLenses, AreOfTheCamerasSizeAndOfAModelThatBoardsTell) {
  calib::LensCamera wide = kLens;
  wide.width_px = 128;
  EXPECT_THAT(
      [&] {
        Calibrate({"left", "right"}, wide);
      },
      ThrowsMessage<Error>(HasSubstr(
          "`camera` left: expected intrinsics of 64 x 48 px as its photos are, found 128 x 48; "
          "give the intrinsics of this camera")));
  const calib::LensCamera fov{calib::CameraModel::kFov, 64, 48, {60, 60, 32, 24, 0.9}};
  EXPECT_THAT(
      [&] {
        Calibrate({"left", "right"}, fov);
      },
      ThrowsMessage<Error>(
          HasSubstr("lens.txt: expected intrinsics that boards are solved with, found FOV")));
}

TEST(RigFile, OfOpenCvHasTwoCameras) {
  const testing::TemporaryFolder folder;
  EXPECT_THAT(
      [&] {
        WriteRigFile(folder / "rig.yml", CalibrationOf({"a", "b", "c"}));
      },
      ThrowsMessage<Error>(
          HasSubstr("expected 2 cameras, as OpenCV's stereo files have, found 3; write a .json")));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(UnseenPhotosOfARig, AreOfItsCamerasWithoutAPattern) {
  const testing::TemporaryFolder folder;
  SilentProgress silent;
  EXPECT_THAT(
      [&] {
        ReadTestPhotos(CalibrationOf({"a", "b"}), folder.path(), "a*", silent);
      },
      ThrowsMessage<UsageError>(HasSubstr(
          "`pattern` a*: is for the photos of one camera; a rig's cameras are distinguished")));
}

}  // namespace
}  // namespace dtr::pipeline
