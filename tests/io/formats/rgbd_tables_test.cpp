// Captures whose tables are as today's programs, spreadsheets and other systems write them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "tests/io/formats/small_capture.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::SizeIs;
using namespace small_capture;

class RgbdTables : public ::testing::Test {
 protected:
  fs::path root() const { return folder_.path(); }

  void WriteDepth(const std::string& name) const {
    fs::create_directories((root() / name).parent_path());
    WritePng16(root() / name, Grid<std::uint16_t>(20, 15, 1, 2500));
  }
  RgbdCapture Read(const char* format) const { return ReadRgbdCapture(root(), format); }
  std::string Says(const char* format) const {
    return MessageOf<Error>([&] { Read(format); });
  }

 private:
  testing::TemporaryFolder folder_;
};

// The columns of today's Stray Scanner, whose last two are empty.
class StrayTables : public RgbdTables {
 protected:
  StrayTables() {
    for (size_t i = 0; i < 3; ++i) WritePhoto(root() / fmt::format("rgb/{:06}.jpg", i));
    // Not the frames' own intrinsics.
    Write(root() / "camera_matrix.csv", "90,0,40\n0,90,30\n0,0,1");
  }
  std::string Row(size_t i, const std::string& between, const std::string& intrinsics) const {
    const Quaterniond q(Frames()[i].world_from_cam);
    const Vector3d c = Frames()[i].centre;
    std::string row = fmt::format("{:.3f}", 100 + 0.5 * i);
    row += between + fmt::format("{:06}", i);
    for (const double value : {c.x(), c.y(), c.z(), q.x(), q.y(), q.z(), q.w()}) {
      row += between + fmt::format("{:.17g}", value);
    }
    return row + between + intrinsics;
  }
  std::string Intrinsics(const std::string& between) const {
    return fmt::format("{}{}{}{}{}{}{}", kK(0, 0), between, kK(1, 1), between, kK(0, 2), between,
                       kK(1, 2));
  }
  std::string Heading(const std::string& between) const {
    std::string heading;
    for (const char* name : {"timestamp", "frame", "x", "y", "z", "qx", "qy", "qz", "qw", "fx",
                             "fy", "cx", "cy", "distortion_center_x", "distortion_center_y"}) {
      heading += (heading.empty() ? "" : between) + name;
    }
    return heading;
  }
};

TEST_F(StrayTables, EmptyCellsAreCellsAndIntrinsicsAreTheFrames) {
  // As the program writes it; with semicolons, tabs, and without what follows the last value.
  for (const auto& [between, end] : {std::pair<std::string, std::string>{", ", ", , \n"},
                                     {",", ",,\n"},
                                     {";", ";;\r\n"},
                                     {"\t", "\t\t\r"},
                                     {", ", "\n"}}) {
    std::string table = Heading(between) + end.substr(end.find_first_of("\r\n"));
    for (size_t i = 0; i < 3; ++i) table += Row(i, between, Intrinsics(between)) + end;
    Write(root() / "odometry.csv", table);
    ExpectCameras(Read("stray-scanner"), 0.5);
    table.erase(table.find_last_not_of("\r\n") + 1);
    Write(root() / "odometry.csv", "\xef\xbb\xbf" + table);
    ExpectCameras(Read("stray-scanner"), 0.5);
  }
}

TEST_F(StrayTables, FramesWithoutIntrinsicsOfTheirOwnHaveTheMatrix) {
  std::string table = Heading(", ") + "\n";
  for (size_t i = 0; i < 3; ++i) table += Row(i, ", ", i == 1 ? Intrinsics(", ") : ", , , ") + "\n";
  Write(root() / "odometry.csv", table);
  const RgbdCapture capture = Read("stray-scanner");
  EXPECT_DOUBLE_EQ(capture.list.cameras[0].camera.fx_px(), 90);
  EXPECT_DOUBLE_EQ(capture.list.cameras[1].camera.fx_px(), kK(0, 0));
  EXPECT_DOUBLE_EQ(capture.list.cameras[2].camera.fx_px(), 90);
}

TEST_F(StrayTables, ColumnsMayStandInAnyOrderAndInQuotes) {
  std::string table = "\"qw\",\"QX\",qy,qz,\"x\",y,z,note,frame,cx,cy,fx,fy\n";
  for (size_t i = 0; i < 3; ++i) {
    const Quaterniond q(Frames()[i].world_from_cam);
    const Vector3d c = Frames()[i].centre;
    table += fmt::format("{:.17g},\"{:.17g}\",{:.17g},{:.17g},{},{},{},\"a, b\",{},{},{},{},{}\n",
                         q.w(), q.x(), q.y(), q.z(), c.x(), c.y(), c.z(), i, kK(0, 2), kK(1, 2),
                         kK(0, 0), kK(1, 1));
  }
  Write(root() / "odometry.csv", table);
  ExpectCameras(Read("stray-scanner"), 0.5);
}

TEST_F(StrayTables, WhatTheyCannotMeanIsNamedWithTheLine) {
  const auto says = [&](const std::string& rows) {
    Write(root() / "odometry.csv", Heading(";") + "\n" + rows);
    return Says("stray-scanner");
  };
  std::string row = Row(0, ";", Intrinsics(";"));
  std::replace(row.begin(), row.end(), '.', ',');
  EXPECT_THAT(says(row + "\n"),
              AllOf(HasSubstr("odometry.csv:2: "), HasSubstr(": expected a finite number"),
                    HasSubstr("with a decimal point, not a comma")));
  EXPECT_THAT(says("1;000000;0;0;0;0;0;0;\n"),
              HasSubstr("odometry.csv:2: qw: expected a finite number, found an empty cell"));
  EXPECT_THAT(says("1;7.5;0;0;0;0;0;0;1\n"), HasSubstr("2: expected a frame number from 0"));
  EXPECT_THAT(says("1;000000;0;0;0;0;0;0;1;70;70;40;30;;;9\n"),
              HasSubstr("expected 15 columns as the first line has, found 16"));
  Write(root() / "odometry.csv", "timestamp, frame, x, y, z\n");
  EXPECT_THAT(Says("stray-scanner"), HasSubstr("expected a column qx, found timestamp, frame, x"));
  Write(root() / "camera_matrix.csv", "90,5;0;40\n0;90,5;30\n0;0;1\n");
  EXPECT_THAT(Says("stray-scanner"), HasSubstr("camera_matrix.csv:1: found '90,5' where a number"));
}

TEST_F(RgbdTables, ListsOfTumMayHaveOtherSeparators) {
  for (const char* between : {",", ", ", ";", "\t"}) {
    std::string rgb = "# time, file\r\n", poses = "# time tx ty tz qx qy qz qw\r\n";
    for (size_t i = 0; i < 3; ++i) {
      WritePhoto(root() / fmt::format("rgb/photo {}.png", i));
      rgb += fmt::format("{}{}\"rgb/photo {}.png\"\r\n", i, between, i);
      const Quaterniond q(Frames()[i].world_from_cam);
      const Vector3d c = Frames()[i].centre;
      poses += fmt::format("{}", i);
      for (const double value : {c.x(), c.y(), c.z(), q.x(), q.y(), q.z(), q.w()}) {
        poses += fmt::format("{}{:.17g}", between, value);
      }
      poses += "\r\n";
    }
    Write(root() / "rgb.txt", rgb);
    Write(root() / "groundtruth.txt", poses);
    Write(root() / "camera-intrinsics.txt",
          fmt::format("{0}{4}0{4}{1}\n0{4}{2}{4}{3}\n0{4}0{4}1", kK(0, 0), kK(0, 2), kK(1, 1),
                      kK(1, 2), between));
    ExpectCameras(Read("tum"), 0);
  }
  // A row that lost a number must not shift the rows behind it.
  Write(root() / "groundtruth.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  EXPECT_THAT(Says("tum"), HasSubstr("groundtruth.txt:2: expected 8 cells in a row, time, position "
                                     "and quaternion, found 7"));
  Write(root() / "groundtruth.txt", "0 0,5 0 0 0 0 0 1\n");
  EXPECT_THAT(Says("tum"), HasSubstr("with numbers that have a decimal point"));
}

class ScannerApp : public RgbdTables {
 protected:
  ScannerApp() {
    for (size_t i = 0; i < 3; ++i) {
      const std::string number = fmt::format("{:05}", 3 * i);
      WritePhoto(root() / ("frame_" + number + ".jpg"));
      WriteDepth("depth_" + number + ".png");
      WriteFrame(number, Frames()[i]);
    }
    // Every frame has its depth, not every one a photo.
    WriteDepth("depth_00001.png");
    WriteFrame("00001", Frames()[0]);
    Write(root() / "info.json", "{\"title\": \"chair\"}");
    WritePhoto(root() / "thumb_00000.jpg");
  }
  void WriteFrame(const std::string& number, const Frame& frame) const {
    // Of photos of 1920x1440, whatever size is exported; row by row; products of floats.
    Matrix3d k = kK;
    k.topRows<2>() *= 24;
    const Matrix3d axes = GlAxes(frame);
    std::string intrinsics, pose;
    for (int i = 0; i < 9; ++i) {
      intrinsics += fmt::format("{}{:.17g}", i > 0 ? ", " : "", k(i / 3, i % 3));
    }
    for (int i = 0; i < 3; ++i) {
      pose += fmt::format("{:.17g}, {:.17g}, {:.17g}, {:.17g}, ", axes(i, 0), axes(i, 1),
                          axes(i, 2), frame.centre[i]);
    }
    Write(
        root() / ("frame_" + number + ".json"),
        fmt::format(
            R"({{"frame_index": 0, "intrinsics": [{}], "cameraPoseARFrame": [{}0, 0, 0, 1.0000001]}})",
            intrinsics, pose));
  }
};

TEST_F(ScannerApp, CapturesAreRead) {
  EXPECT_EQ(RgbdFormatOf(root()), "3d-scanner-app");
  const RgbdCapture capture = Read("3d-scanner-app");
  ExpectCameras(capture, 0.5);
  EXPECT_EQ(capture.depth_unit_m, 0.001);
  EXPECT_EQ(capture.list.cameras[1].depth_file, "depth_00003.png");
  EXPECT_THAT(capture.skipped, SizeIs(1));
  EXPECT_THAT(capture.notes, ::testing::Contains(HasSubstr("1 of 4 frames are left out")));
  ExpectCutsNoticed(root(), root() / "frame_00003.json", "3d-scanner-app");
}

TEST_F(ScannerApp, DepthOfTheLowestConfidenceIsLeftOut) {
  ImageRgb8 levels(20, 15, 3, 2);
  for (int c = 0; c < 3; ++c) levels(4, 3, c) = 0, levels(5, 3, c) = 1;
  for (const char* number : {"00000", "00003", "00006"}) {
    WriteImage(root() / fmt::format("conf_{}.png", number), levels);
  }
  const RgbdCapture capture = Read("3d-scanner-app");
  EXPECT_THAT(capture.confidence_line, HasSubstr("left out, 0.3 % of the pixels of 3 maps"));
  const fs::path confidence = capture.confidence.FileOf("depth_00003.png");
  EXPECT_EQ(confidence.filename(), "conf_00003.png");
  DepthImage depth =
      ReadDepthOfAnySize(root() / "depth_00003.png", DepthKind::kPlaneZ, 0.001, 80, 60);
  LeaveOutLowConfidence(confidence, depth);
  EXPECT_TRUE(DepthImage::IsHole(depth(4, 3)));
  EXPECT_FLOAT_EQ(depth(5, 3), 2.5f);
}

}  // namespace
}  // namespace dtr::io
