// Recordings of Record3D as .r3d files, which its program writes as ZIP archives.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "tests/io/formats/small_capture.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"
#include "tests/support/zip_file.h"

namespace dtr::io {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using namespace small_capture;
using testing::ZipEntries;

constexpr size_t kMaxBytes = 1 << 20;

/// Depth of 20x15 that grows by rows, without depth at the first pixel.
std::string DepthBytes() {
  std::string bytes;
  for (int i = 0; i < 20 * 15; ++i) {
    const float z =
        i == 0 ? std::numeric_limits<float>::quiet_NaN() : 1 + 0.01f * static_cast<float>(i);
    char raw[sizeof z];
    std::memcpy(raw, &z, sizeof z);
    bytes.append(raw, sizeof z);
  }
  return bytes;
}

class Record3dFile : public ::testing::Test {
 protected:
  fs::path file() const { return folder_ / "2026-11-28--10-00-00.r3d"; }
  fs::path root() const { return folder_.path(); }

  /// The bytes of a JPEG.
  std::string Photo(int width = 80, int height = 60) const {
    WritePhoto(folder_ / "photo.jpg", width, height);
    return ReadFile(folder_ / "photo.jpg", kMaxBytes);
  }

  /// `K` for the columns' matrix, or another matrix for each frame.
  static std::string Metadata(bool per_frame = false) {
    std::string poses, own;
    for (const Frame& frame : Frames()) {
      const Quaterniond q(GlAxes(frame));
      const Vector3d& c = frame.centre;
      poses +=
          fmt::format("{}[{:.17g}, {:.17g}, {:.17g}, {:.17g}, {}, {}, {}]",
                      poses.empty() ? "" : ", ", q.x(), q.y(), q.z(), q.w(), c.x(), c.y(), c.z());
      own += fmt::format("{}[{}, {}, {}, {}]", own.empty() ? "" : ", ", kK(0, 0), kK(1, 1),
                         kK(0, 2), kK(1, 2));
    }
    const double f = per_frame ? 50 : kK(0, 0);  // what each frame has of its own wins
    return fmt::format(
        R"({{"w": 80, "h": 60, "dw": 20, "dh": 15, "fps": 60, "cameraType": 1,
"initPose": [0, 0, 0, 1, 0, 0, 0], "K": [{}, 0, 0, 0, {}, 0, {}, {}, 1], "poses": [{}]{}}})",
        f, kK(1, 1), kK(0, 2), kK(1, 2), poses,
        per_frame ? ", \"perFrameIntrinsicCoeffs\": [" + own + "]" : "");
  }

  ZipEntries Recording(const std::string& metadata, const std::string& photo) const {
    ZipEntries entries = {{"metadata", metadata}, {"icon", photo}, {"sound.m4a", "a sound"}};
    for (int i = 0; i < 3; ++i) {
      const std::string stem = "rgbd/" + std::to_string(i);
      entries.emplace_back(stem + ".jpg", photo);
      entries.emplace_back(stem + ".depth", testing::StoredAsLzfse(DepthBytes()));
      entries.emplace_back(stem + ".conf", testing::StoredAsLzfse(std::string(300, '\2')));
    }
    return entries;
  }

  std::string ErrorOf() const {
    const std::string message =
        testing::MessageOf<Error>([&] { ReadRgbdCapture(file(), "record3d"); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  }

 private:
  testing::TemporaryFolder folder_;
};

TEST_F(Record3dFile, CamerasPhotosAndDepthAreThoseOfTheRecording) {
  for (const bool deflated : {false, true}) {
    const std::string photo = Photo();
    testing::WriteZip(file(), Recording(Metadata(), photo), deflated);
    ASSERT_EQ(RgbdFormatOf(file()), "record3d");
    fs::path images;
    {
      const RgbdCapture capture = ReadRgbdCapture(file(), "record3d");
      ExpectCameras(capture, 0.5);
      EXPECT_THAT(capture.skipped, SizeIs(0));
      EXPECT_EQ(capture.list.cameras[2].name, "2.jpg");
      EXPECT_EQ(capture.list.cameras[2].depth_file, "2.depth");
      EXPECT_EQ(capture.depth_unit_m, 1);
      EXPECT_TRUE(ReadFile(capture.images / "1.jpg", kMaxBytes) == photo) << "byte for byte";
      const DepthImage depth = ReadDepthOfAnySize(capture.depth / "1.depth", DepthKind::kPlaneZ,
                                                  capture.depth_unit_m, 80, 60);
      ASSERT_EQ(depth.width(), 20);
      ASSERT_EQ(depth.height(), 15);
      EXPECT_TRUE(DepthImage::IsHole(depth(0, 0)));
      EXPECT_FLOAT_EQ(depth(1, 0), 1.01f);
      EXPECT_FLOAT_EQ(depth(3, 2), 1.43f);
      images = capture.images;
    }
    EXPECT_FALSE(fs::exists(images)) << "what was unpacked goes with the capture";
  }
}

TEST_F(Record3dFile, ItsUnpackedFolderIsReadAsWell) {
  for (const auto& [name, bytes] : Recording(Metadata(), Photo())) {
    Write(root() / "scan" / name, bytes);
  }
  ASSERT_EQ(RgbdFormatOf(root() / "scan"), "record3d");
  const RgbdCapture capture = ReadRgbdCapture(root() / "scan", "record3d");
  ExpectCameras(capture, 0.5);
  EXPECT_EQ(capture.images, root() / "scan/rgbd");
  EXPECT_THAT(capture.skipped, SizeIs(0));
  ExpectCutsNoticed(root() / "scan", root() / "scan/metadata", "record3d");
}

TEST_F(Record3dFile, IntrinsicsOfEachFrameAndPhotosOfAnotherSize) {
  testing::WriteZip(file(), Recording(Metadata(true), Photo(160, 120)));
  ExpectCameras(ReadRgbdCapture(file(), "record3d"), 0.5, 2);
}

TEST_F(Record3dFile, FramesWithoutAPoseOrAPhotoAreListed) {
  ZipEntries entries = Recording(Metadata(), Photo());
  std::erase_if(entries, [](const auto& entry) { return entry.first == "rgbd/1.jpg"; });
  entries.emplace_back("rgbd/3.jpg", Photo());
  testing::WriteZip(file(), entries);
  const RgbdCapture capture = ReadRgbdCapture(file(), "record3d");
  EXPECT_THAT(capture.list.cameras, SizeIs(2));
  ASSERT_THAT(capture.skipped, SizeIs(2));
  EXPECT_EQ(capture.skipped[0].second, "no photo in " + (file() / "rgbd").string());
  EXPECT_EQ(capture.skipped[1], std::make_pair(std::string("3.jpg"), std::string("no pose")));
  EXPECT_THAT(capture.notes, Contains(HasSubstr("2 of 4 frames are left out")));
}

TEST_F(Record3dFile, EveryTruncatedPrefixIsRejected) {
  testing::WriteZip(file(), Recording(Metadata(), Photo()));
  testing::ExpectEveryPrefixIsAnError(file(), 61, [&] { ReadRgbdCapture(file(), "record3d"); });
}

TEST_F(Record3dFile, WhatIsNoRecordingIsNamed) {
  Write(file(), "RED1 of another camera");
  EXPECT_THAT(ErrorOf(), HasSubstr(file().string() +
                                   ": expected a recording of Record3D (a ZIP archive), found"));
  testing::WriteZip(file(), {{"readme", "nothing"}});
  EXPECT_THAT(ErrorOf(), HasSubstr("found no file called metadata in it; export it again as .r3d"));
  testing::WriteZip(file(), Recording("{\"w\": 80}", Photo()));
  EXPECT_THAT(ErrorOf(), HasSubstr((file() / "metadata").string()));
}

TEST_F(Record3dFile, ADamagedPhotoInItIsNamed) {
  testing::WriteZip(file(), Recording(Metadata(), Photo()));
  std::string bytes = ReadFile(file(), kMaxBytes);
  const size_t depth = bytes.find("bvx-");
  ASSERT_NE(depth, std::string::npos);
  bytes[depth + 20] = static_cast<char>(bytes[depth + 20] ^ 1);
  Write(file(), bytes);
  EXPECT_THAT(ErrorOf(), HasSubstr("CRC error"));
}

// Two files of one name: nobody knows which is meant.
TEST_F(Record3dFile, NamesThatAreThereTwiceAreRejected) {
  ZipEntries entries = Recording(Metadata(), Photo());
  entries.emplace_back("rgbd/7.jpg", Photo());
  testing::WriteZip(file(), entries);
  std::string bytes = ReadFile(file(), kMaxBytes);
  for (size_t at = 0; (at = bytes.find("rgbd/7.jpg", at)) != std::string::npos;)
    bytes[at + 5] = '0';
  Write(file(), bytes);
  EXPECT_THAT(ErrorOf(), HasSubstr("expected a recording of Record3D"));
}

// No name of the archive leads out of the folder it is unpacked to, or fills a disk.
TEST_F(Record3dFile, NothingButAFramesFilesIsUnpacked) {
  ZipEntries entries = Recording(Metadata(), Photo());
  for (const char* name : {"../out.jpg", "rgbd/../../out.jpg", "/tmp/out.jpg", "rgbd/x.jpg",
                           "rgbd/0.jpg.sh", "rgbd/.jpg", "rgbd/0000000000.jpg", "metadata/x"}) {
    entries.emplace_back(name, "out");
  }
  testing::WriteZip(file(), entries);
  const RgbdCapture capture = ReadRgbdCapture(file(), "record3d");
  size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(capture.images.parent_path())) {
    files += entry.is_regular_file();
  }
  EXPECT_EQ(files, 10u) << "metadata, three photos, three depth maps, three of confidence";
}

TEST_F(Record3dFile, FilesThatGrowBeyondWhatTheArchiveCanHoldAreRejected) {
  ZipEntries entries = Recording(Metadata(), Photo());
  entries.emplace_back("rgbd/8.jpg", std::string(80 << 20, '\0'));
  testing::WriteZip(file(), entries, true);
  EXPECT_THAT(ErrorOf(), HasSubstr("rgbd/8.jpg of too many bytes"));
}

// Confidence as ARKit has it: 0, 1 and 2.
TEST_F(Record3dFile, DepthOfTheLowestConfidenceIsLeftOut) {
  std::string levels(300, '\2');
  levels[1] = 0, levels[2] = 1;
  ZipEntries entries = Recording(Metadata(), Photo());
  for (auto& [name, bytes] : entries) {
    if (name == "rgbd/1.conf") bytes = testing::StoredAsLzfse(levels);
  }
  testing::WriteZip(file(), entries);
  const RgbdCapture capture = ReadRgbdCapture(file(), "record3d");
  EXPECT_EQ(capture.confidence_line,
            file().string() +
                ": depth of the lowest confidence is left out, 0.1 % of the pixels of 3 maps");
  EXPECT_THAT(capture.notes, Contains(capture.confidence_line));
  DepthImage depth = ReadDepthOfAnySize(capture.depth / "1.depth", DepthKind::kPlaneZ, 1, 80, 60);
  LeaveOutLowConfidence(capture.confidence.FileOf("1.depth"), depth);
  EXPECT_TRUE(DepthImage::IsHole(depth(1, 0)));
  EXPECT_FLOAT_EQ(depth(2, 0), 1.02f);
  EXPECT_FLOAT_EQ(depth(3, 2), 1.43f);
}

TEST_F(Record3dFile, ConfidenceThatLeavesNothingOrIsAbsentIsNotUsed) {
  ZipEntries entries = Recording(Metadata(), Photo());
  for (auto& [name, bytes] : entries) {
    if (name.ends_with(".conf")) bytes = testing::StoredAsLzfse(std::string(300, '\0'));
  }
  testing::WriteZip(file(), entries);
  const RgbdCapture capture = ReadRgbdCapture(file(), "record3d");
  EXPECT_THAT(capture.notes, Contains(HasSubstr("its confidence maps are 0 throughout")));
  EXPECT_TRUE(capture.confidence.FileOf("1.depth").empty());
  std::erase_if(entries, [](const auto& entry) { return entry.first.ends_with(".conf"); });
  testing::WriteZip(file(), entries);
  EXPECT_EQ(ReadRgbdCapture(file(), "record3d").confidence_line, "");
}

TEST_F(Record3dFile, ConfidenceOfAnotherSizeOrCutShortIsAnError) {
  Write(root() / "0.conf", testing::StoredAsLzfse(std::string(299, '\2')));
  DepthImage depth(20, 15, DepthKind::kPlaneZ);
  EXPECT_THAT(testing::MessageOf<Error>([&] { LeaveOutLowConfidence(root() / "0.conf", depth); }),
              HasSubstr("expected a confidence map of the depth map's 20x15 pixels, found 299"));
  testing::ExpectEveryPrefixIsAnError(root() / "0.conf", 7,
                                      [&] { LowConfidenceShare(root() / "0.conf"); });
}

class Record3dDepth : public ::testing::Test {
 protected:
  DepthImage Read(int width = 72, int height = 96) const {
    return ReadDepthOfAnySize(file_, DepthKind::kPlaneZ, 1, width, height);
  }
  testing::TemporaryFolder folder_;
  const fs::path file_ = folder_ / "0.depth";
};

// The stream of the reference encoder (lzfse_test.cpp), of an upright photo: 36x48.
TEST_F(Record3dDepth, HasTheShapeOfItsPhoto) {
  fs::copy("tests/io/formats/lzfse/depth.lzfse", file_);
  const DepthImage depth = Read();
  ASSERT_EQ(depth.width(), 36);
  ASSERT_EQ(depth.height(), 48);
  EXPECT_FLOAT_EQ(depth(5, 7), 1.5f + 0.05f + 0.14f);
  EXPECT_EQ(depth(18, 24), 1);
  EXPECT_TRUE(DepthImage::IsHole(depth(33, 3)));
  EXPECT_EQ(Read(96, 72).width(), 48);
}

TEST_F(Record3dDepth, EveryTruncatedPrefixIsRejected) {
  fs::copy("tests/io/formats/lzfse/depth.lzfse", file_);
  testing::ExpectEveryPrefixIsAnError(file_, 7, [&] { Read(); });
}

TEST_F(Record3dDepth, NumbersThatAreNoMapOfThePhotoAreRejected) {
  for (const size_t bytes : {size_t{0}, size_t{4 * 36 * 48 - 4}, size_t{4 * 36 * 48 + 1}}) {
    Write(file_, testing::StoredAsLzfse(std::string(bytes, '\0')));
    EXPECT_THAT(testing::MessageOf<Error>([&] { Read(); }),
                HasSubstr("expected a depth map of the shape of its photo of 72x96, found"))
        << bytes;
  }
  Write(file_, testing::StoredAsLzfse(std::string(4 * 17 * 72 * 96, '\0')));
  EXPECT_THAT(testing::MessageOf<Error>([&] { Read(); }), HasSubstr("more bytes than it may"));
}

}  // namespace
}  // namespace dtr::io
