// Portrait photos of a camera that boards calibrate: with an EXIF orientation, or rotated by a
// program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/files/calibration.h"
#include "dtr/io/image_io.h"
#include "tests/capture/photo_files.h"
#include "tests/cli/chessboard_set.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kChessboard = "chessboard:9x6:1";
// The detector's own rounding, in a rotated photo: 5e-5 px at most of a corner, 3e-5 px of a focal
// length or principal point, 5e-7 of a coefficient. The wrong way is pixels off.
constexpr double kSameCornerPx = 1e-3, kSameCameraPx = 1e-3, kSameDistortion = 1e-5;
constexpr int kClockwise = 6, kCounterclockwise = 8;  // EXIF orientations that rotate so

class RotatedPhotos : public ChessboardSet {
 protected:
  // The photos SIDE01 to SIDE14, each rotated as `orientation` says of its number.
  void Write(const std::string& folder, const std::string& side,
             const std::function<int(int)>& orientation, int photos = 14) {
    fs::create_directories(In(folder));
    for (int i = 1; i <= photos; ++i) {
      const std::string name = fmt::format("{}{:02}", side, i);
      io::WriteImage(
          fs::path(In(folder)) / (name + ".png"),
          io::ApplyExifOrientation(io::ReadImage(Photos() / (name + ".jpg")), orientation(i)));
    }
  }
  Json Calibrate(const std::string& folder, std::string* notes = nullptr) {
    const Ran ran =
        DtrCalibrated({"calibrate", "board", In(folder), "--board", kChessboard, "--model",
                       "brown4", "-o", In(folder + "_out/camera.json"), "--json", "-", "--force"});
    if (notes) *notes = ran.err;
    return Json::parse(ran.out);
  }
  calib::Calibration Result(const std::string& folder) {
    return calib::ReadCalibration(In(folder + "_out/camera.json"));
  }
  void SetUp() override {
    for (const char* folder : {"plain", "rotated", "tagged"}) {
      fs::create_directories(In(std::string(folder) + "_out"));
    }
  }
};

void ExpectSameCamera(const calib::LensCamera& found, const calib::LensCamera& expected) {
  EXPECT_EQ(found.width_px, expected.width_px);
  EXPECT_EQ(found.height_px, expected.height_px);
  ASSERT_EQ(found.params.size(), expected.params.size());
  for (size_t i = 0; i < found.params.size(); ++i) {
    EXPECT_NEAR(found.params[i], expected.params[i], i < 4 ? kSameCameraPx : kSameDistortion) << i;
  }
}

// A photo may be counted from the other end of the board.
double LargestDistancePx(const calib::BoardView& a, const calib::BoardView& b) {
  double as_is = 0, turned = 0;
  for (size_t i = 0; i < a.corners.size(); ++i) {
    const size_t other = a.corners.size() - 1 - i;
    as_is = std::max(as_is, (a.corners[i].pixel - b.corners[i].pixel).norm());
    turned = std::max(turned, (a.corners[i].pixel - b.corners[other].pixel).norm());
  }
  return std::min(as_is, turned);
}

TEST_F(RotatedPhotos, AnExifOrientationChangesNoByteOfTheCalibration) {
  DTR_REQUIRE_DATA(Photos());
  for (const char* folder : {"plain", "tagged"}) {
    fs::create_directory(In(folder));
    for (int i = 1; i <= 14; ++i) {
      const std::string name = fmt::format("left{:02}.jpg", i);
      const fs::path copy = fs::path(In(folder)) / name;
      fs::copy_file(Photos() / name, copy);
      // Photos 1 to 7 are landscape, mirrored and portrait, 2 to 8; of the rest every other one.
      const int orientation = i <= 7 ? i + 1 : i % 2 == 0 ? 6 : 1;
      if (folder == std::string("tagged")) capture::testing::AddExifOrientation(copy, orientation);
    }
  }
  const Json plain = Calibrate("plain"), tagged = Calibrate("tagged");
  EXPECT_EQ(tagged["views"].size(), 14u);
  EXPECT_EQ(plain, tagged);
  EXPECT_EQ(Text(In("plain_out/camera.json")), Text(In("tagged_out/camera.json")));
  // All of them portrait.
  for (const auto& photo : fs::directory_iterator(In("tagged"))) {
    fs::copy_file(fs::path(In("plain")) / photo.path().filename(), photo.path(),
                  fs::copy_options::overwrite_existing);
    capture::testing::AddExifOrientation(photo.path(), 6);
  }
  EXPECT_EQ(plain, Calibrate("tagged"));
  EXPECT_EQ(Text(In("plain_out/camera.json")), Text(In("tagged_out/camera.json")));
}

TEST_F(RotatedPhotos, ThoseThatAProgramRotatedGiveTheCameraOfTheUnrotated) {
  DTR_REQUIRE_DATA(Photos());
  Write("plain", "left", [](int) { return 1; });
  // Some one way, some the other.
  Write("rotated", "left", [](int i) {
    return i % 3 != 0 ? 1 : i % 2 == 0 ? kCounterclockwise : kClockwise;
  });
  Calibrate("plain");
  std::string notes;
  const Json json = Calibrate("rotated", &notes);
  EXPECT_THAT(notes, HasSubstr("4 photos that a program had rotated, 2 clockwise and 2 "
                               "counterclockwise: corners put back on the sensor's grid of 640 x "
                               "480 px"));
  EXPECT_EQ(json["rotated_photos"], Json::parse(R"({"clockwise": 2, "counterclockwise": 2})"));
  EXPECT_TRUE(json["left_out"].empty()) << json["left_out"];
  const calib::Calibration plain = Result("plain"), rotated = Result("rotated");
  ExpectSameCamera(rotated.cameras[0].camera, plain.cameras[0].camera);
  ASSERT_EQ(rotated.views.size(), 14u);
  for (size_t v = 0; v < 14; ++v) {
    EXPECT_EQ(rotated.views[v].seen.name, plain.views[v].seen.name);
    EXPECT_LT(LargestDistancePx(rotated.views[v].seen, plain.views[v].seen), kSameCornerPx) << v;
    const int i = static_cast<int>(v) + 1;
    EXPECT_EQ(calib::DegreesOf(rotated.views[v].seen.rotation), i % 3 != 0   ? 0
                                                                : i % 2 == 0 ? 270
                                                                             : 90);
  }
}

TEST_F(RotatedPhotos, OfAsManyPortraitPhotosAsOthersTheLandscapeGridIsTheSensors) {
  DTR_REQUIRE_DATA(Photos());
  Write("plain", "right", [](int) { return 1; });
  Write("rotated", "right", [](int i) { return i <= 7 ? kCounterclockwise : 1; });
  Calibrate("plain");
  const Json json = Calibrate("rotated");
  EXPECT_EQ(json["rotated_photos"]["counterclockwise"], 7);
  ExpectSameCamera(Result("rotated").cameras[0].camera, Result("plain").cameras[0].camera);
}

TEST_F(RotatedPhotos, WhatCannotBePutBackIsLeftOutWithTheReason) {
  DTR_REQUIRE_DATA(Photos());
  Write("rotated", "left", [](int i) { return i > 12 ? kClockwise : 1; });
  // Of another size, and not with swapped sides.
  const fs::path cropped = fs::path(In("rotated")) / "left12.png";
  const ImageRgb8 whole = io::ReadImage(cropped);
  ImageRgb8 larger(680, 500, 3, 128);
  for (int y = 0; y < whole.height(); ++y) {
    for (int x = 0; x < whole.width(); ++x) {
      for (int c = 0; c < 3; ++c) larger(x, y, c) = whole(x, y, c);
    }
  }
  io::WriteImage(cropped, larger);
  const Json json = Calibrate("rotated");
  EXPECT_EQ(json["views"].size(), 13u);
  ASSERT_EQ(json["left_out"].size(), 1u);
  EXPECT_EQ(json["left_out"][0]["name"], "left12.png");
  EXPECT_THAT(json["left_out"][0]["reason"].get<std::string>(),
              HasSubstr("its size, 680 x 500 px, is not that of the others, 640 x 480 px"));
  // Two that are not rotated determine no camera to compare the others with.
  Write(
      "few", "left", [](int i) { return i > 2 ? kClockwise : 1; }, 4);
  const Ran few = Dtr({"calibrate", "board", In("few"), "--board", kChessboard, "--model", "brown4",
                       "-o", In("few.json")});
  ExpectRejected(few, kFailed, "expected at least 3 images with the board, found 2");
  EXPECT_THAT(few.err, HasSubstr("2 photos that a program had rotated left out; left03.png: "));
}

std::string FromBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    if ((held += 6) < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 255);
  }
  return bytes;
}

std::vector<std::string> BehindEach(const std::string& text, const std::string& start) {
  std::vector<std::string> found;
  for (size_t at = text.find(start); at != std::string::npos; at = text.find(start, at + 1)) {
    const size_t from = at + start.size();
    found.push_back(text.substr(from, text.find('"', from) - from));
  }
  return found;
}

// A camera that half a turn does not change cannot tell which way photos were rotated.
TEST_F(RotatedPhotos, WhereNoneCanBePutBackValidateSaysWhy) {
  DTR_REQUIRE_DATA(Photos());
  Write(
      "rotated", "left", [](int) { return kClockwise; }, 3);
  WriteFileAtomically(In("camera.txt"), "1 OPENCV 640 480 533 533 320 240 -0.28 0.08 0 0\n");
  ExpectRejected(
      Dtr({"validate", In("camera.txt"), "--board", kChessboard, "--images", In("rotated")}),
      kFailed,
      "none of the photos that show the board can be used; left01.png: its 480 x 640 px "
      "are rotated against the 640 x 480 px of the camera, and which way cannot be found");
}

// The photos in a page, each within a drawing.
std::vector<std::string> PhotosIn(const std::string& page) {
  std::vector<std::string> photos;
  for (const std::string& drawing : BehindEach(page, "data:image/svg+xml;base64,")) {
    for (const std::string& photo : BehindEach(FromBase64(drawing), "data:image/jpeg;base64,")) {
      photos.push_back(photo);
    }
  }
  return photos;
}

TEST_F(RotatedPhotos, ValidateReadsAndDrawsThemAsTheUnrotated) {
  DTR_REQUIRE_DATA(Photos());
  DtrCalibrated({"calibrate", "board", Photos().string(), "--images", "left0*.jpg", "--board",
                 kChessboard, "--model", "brown4", "-o", In("left.json")});
  Write("plain", "left", [](int) { return 1; });
  Write("rotated", "left", [](int) { return kClockwise; });  // all: the camera says which way
  std::map<std::string, Json> json;
  std::map<std::string, std::vector<std::string>> photos;
  for (const std::string folder : {"plain", "rotated"}) {
    const Ran ran = Dtr({"validate", In("left.json"), "--images", In(folder), "--report",
                         In(folder + ".html"), "--json", "-"});
    ASSERT_TRUE(ran.code == 0 || ran.code == kFailed) << ran.err;
    // The first nine made the calibration, rotated or not.
    EXPECT_THAT(ran.err, HasSubstr("left out: left09.png: not held out"));
    EXPECT_THAT(ran.err, Not(HasSubstr("left out: left10.png")));
    json[folder] = Json::parse(ran.out);
    photos[folder] = PhotosIn(Text(In(folder + ".html")));
  }
  EXPECT_EQ(json["plain"]["rotated_photos"]["clockwise"], 0);
  EXPECT_EQ(json["rotated"]["rotated_photos"]["clockwise"], 5);
  const Json &plain = json["plain"]["cameras"][0], &rotated = json["rotated"]["cameras"][0];
  EXPECT_NEAR(plain["stored"]["rms_px"], rotated["stored"]["rms_px"], kSameCornerPx);
  ASSERT_EQ(rotated["views"].size(), 5u);
  EXPECT_EQ(rotated["views"][0]["name"], plain["views"][0]["name"]);
  EXPECT_EQ(rotated["views"][0]["photo_rotation_deg"], 90);
  EXPECT_EQ(photos["plain"].size(), 4u);
  EXPECT_TRUE(photos["plain"] == photos["rotated"]) << "photos lie under their corners";
}

TEST_F(RotatedPhotos, ARigPutsBackEachCamerasOwn) {
  DTR_REQUIRE_DATA(Photos());
  std::map<std::string, calib::Calibration> rigs;
  for (const std::string folder : {"plain", "rotated"}) {
    const bool rotate = folder == "rotated";
    Write(folder, "left", [&](int i) { return rotate && i <= 4 ? kClockwise : 1; });
    Write(folder, "right", [&](int i) { return rotate && i > 8 ? kCounterclockwise : 1; });
    const Ran ran = DtrCalibrated({"calibrate", "rig", In(folder), "--board", kChessboard,
                                   "--model", "brown4", "-o", In(folder + ".json"), "--json", "-"});
    EXPECT_EQ(Json::parse(ran.out)["rotated_photos"]["clockwise"], rotate ? 4 : 0);
    EXPECT_EQ(Json::parse(ran.out)["rotated_photos"]["counterclockwise"], rotate ? 6 : 0);
    if (rotate) {
      EXPECT_THAT(ran.err, HasSubstr("camera right: 6 photos that a program had rotated"));
    }
    rigs[folder] = calib::ReadCalibration(In(folder + ".json"));
  }
  for (size_t c = 0; c < 2; ++c) {
    ExpectSameCamera(rigs["rotated"].cameras[c].camera, rigs["plain"].cameras[c].camera);
  }
  EXPECT_EQ(rigs["rotated"].views.size(), 28u);
  const Eigen::Vector3d shift = rigs["rotated"].cameras[1].cam_from_rig.translation -
                                rigs["plain"].cameras[1].cam_from_rig.translation;
  EXPECT_LT(shift.norm(), 1e-4) << "squares";
}

}  // namespace
}  // namespace dtr::testing
