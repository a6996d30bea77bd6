#include "capture/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "capture/capture_json.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "tests/capture/photo_files.h"
#include "tests/support/on_threads.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using testing::AddExifOrientation;
using testing::BlockPhoto;
using ::testing::HasSubstr;
using testing::MessageOf;
using testing::NoisePhoto;

constexpr size_t kFileLimit = 1 << 20;

Capture Ingest(const fs::path& folder) {
  SilentProgress progress;
  return IngestPhotos(folder, {}, progress);
}

// Photos of every kind: with EXIF, turned, in a sub-folder, one with GPS-free PNG, one skipped.
void FillWithPhotos(const fs::path& folder) {
  fs::create_directories(folder / "left");
  io::WriteJpegWithExif(folder / "A b.JPG", BlockPhoto(48, 32, 1), 90,
                        {35.0, 50.0, "Canon", "EOS"});
  io::WriteImage(folder / "left/turned.jpg", BlockPhoto(48, 32, 2));
  AddExifOrientation(folder / "left/turned.jpg", 6);
  io::WriteImage(folder / "left/plain.png", NoisePhoto(40, 30, 3));
  WriteFileAtomically(folder / "text.jpg", "no photo");
}

void ExpectSameFacts(const Capture& a, const Capture& b) {
  ASSERT_EQ(a.photos.size(), b.photos.size());
  for (size_t i = 0; i < a.photos.size(); ++i) {
    const Photo &x = a.photos[i], &y = b.photos[i];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.width_px, y.width_px);
    EXPECT_EQ(x.height_px, y.height_px);
    EXPECT_EQ(x.focal_prior_px, y.focal_prior_px);  // doubles survive JSON to the last bit
    EXPECT_EQ(x.focal_source, y.focal_source);
    EXPECT_EQ(x.camera_group, y.camera_group);
    EXPECT_EQ(x.source_sha256, y.source_sha256);
    ASSERT_EQ(x.gps.has_value(), y.gps.has_value());
    if (x.gps) {
      EXPECT_EQ(x.gps->latitude_deg, y.gps->latitude_deg);
      EXPECT_EQ(x.gps->altitude_m, y.gps->altitude_m);
      EXPECT_EQ(x.gps->horizontal_error_m, y.gps->horizontal_error_m);
    }
    EXPECT_EQ(x.screening->sharpness, y.screening->sharpness);
    EXPECT_EQ(x.screening->remarks, y.screening->remarks);
  }
  ASSERT_EQ(a.skipped.size(), b.skipped.size());
  EXPECT_EQ(a.skipped[0].name, b.skipped[0].name);
  EXPECT_EQ(a.skipped[0].reason, b.skipped[0].reason);
}

TEST(Capture, RemarksOnFilesAreStored) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  io::WriteImage(folder / "photos/1.png", testing::BlockPhoto(48, 32, 1));
  std::vector<float> values(5 * 48 * 32, 0.5F);
  OIIO::ImageSpec spec(48, 32, 5, OIIO::TypeDesc::HALF);
  spec.channelnames = {"R", "G", "B", "Z", "id"};
  dtr::testing::WriteForeign(folder / "photos/2.exr", spec, values);
  SilentProgress progress;
  const Capture capture = IngestPhotos(folder / "photos", {}, progress);
  WriteCapture(capture, folder / "capture");
  const Capture read = ReadCapture(folder / "capture");
  ASSERT_EQ(read.remarks.size(), 1u);
  EXPECT_EQ(read.remarks[0].name, "2.exr");
  EXPECT_EQ(read.remarks[0].text, "of its 5 channels only the colours are used");
}

TEST(WriteCapture, ComesBackWithTheSameFactsAndPixels) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  Capture capture = Ingest(folder / "photos");
  capture.photos[0].gps = io::GpsPosition{55.7, -13.2, 37.5, 4.5};
  capture.photos[1].gps = io::GpsPosition{-5.7, 13.2, std::nullopt, std::nullopt};
  WriteCapture(capture, folder / "out/");
  const Capture back = ReadCapture(folder / "out");
  ExpectSameFacts(capture, back);
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    EXPECT_EQ(ReadPhoto(back.photos[i]), ReadPhoto(capture.photos[i])) << capture.photos[i].name;
    EXPECT_EQ(back.photos[i].exif_orientation, 1);
  }
  EXPECT_FALSE(fs::exists(folder / "out.partial"));
  // Ingesting a capture is reading it: original names stay.
  ExpectSameFacts(capture, Ingest(folder / "out"));
}

TEST(WriteCapture, UprightPhotosKeepTheirBytes) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  WriteCapture(Ingest(folder / "photos"), folder / "out");
  EXPECT_EQ(ReadFile(folder / "out/images/A_b.jpg", kFileLimit),
            ReadFile(folder / "photos/A b.JPG", kFileLimit));
  EXPECT_TRUE(fs::exists(folder / "out/images/left_turned.png"));
}

TEST(WriteCapture, SameBytesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  const Capture capture = Ingest(folder / "photos");
  OnThreads(1, [&] { return WriteCapture(capture, folder / "one"); });
  OnThreads(4, [&] { return WriteCapture(capture, folder / "four"); });
  for (const char* file : {"capture.json", "images/left_turned.png"}) {
    EXPECT_EQ(ReadFile(folder / "one" / file, kFileLimit),
              ReadFile(folder / "four" / file, kFileLimit));
  }
}

TEST(WriteCapture, LeavesWhatIsThereUnlessToldToReplaceACapture) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  const Capture capture = Ingest(folder / "photos");
  SilentProgress progress;
  EXPECT_THAT(MessageOf<UsageError>([&] { WriteCapture(capture, folder / "photos"); }),
              HasSubstr("something in it already"));
  EXPECT_THAT(MessageOf<UsageError>(
                  [&] { WriteCapture(capture, folder / "photos", {.replace = true}, progress); }),
              HasSubstr("no capture"));
  fs::create_directory(folder / "empty");
  EXPECT_NO_THROW(WriteCapture(capture, folder / "empty"));
  EXPECT_THROW(WriteCapture(capture, folder / "empty"), UsageError);
  EXPECT_NO_THROW(WriteCapture(capture, folder / "empty", {.replace = true}, progress));
  EXPECT_FALSE(fs::exists(folder / "empty.replaced"));
  WriteFileAtomically(folder / "empty/notes.txt", "mine");
  EXPECT_THAT(MessageOf<UsageError>(
                  [&] { WriteCapture(capture, folder / "empty", {.replace = true}, progress); }),
              HasSubstr("found notes.txt; move it away"));
  EXPECT_TRUE(fs::exists(folder / "empty/notes.txt"));
  WriteFileAtomically(folder / "file", "");
  EXPECT_THROW(WriteCapture(capture, folder / "file"), UsageError);
}

TEST(WriteCapture, APhotoThatVanishedIsAnErrorAndNothingAppears) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  const Capture capture = Ingest(folder / "photos");
  fs::remove(folder / "photos/left/plain.png");
  EXPECT_THROW(WriteCapture(capture, folder / "out"), Error);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(WriteCapture, ClearsAnUnfinishedCaptureAndNothingElse) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  const Capture capture = Ingest(folder / "photos");
  const auto leave = [&](const std::string& file) {  // what a killed process or somebody left
    fs::create_directories((folder / file).parent_path());
    std::ofstream(folder / file) << "stale";
  };
  leave("out.partial/capture.lock");
  leave("out.partial/images/old.png");
  leave("out.partial/frames/frame_000001.jpg");
  leave("out.frames.partial/frame_000001.jpg");
  EXPECT_NO_THROW(WriteCapture(capture, folder / "out"));
  EXPECT_FALSE(fs::exists(folder / "out/images/old.png"));
  EXPECT_FALSE(fs::exists(folder / "out/frames"));
  EXPECT_FALSE(fs::exists(folder / "out/capture.lock"));
  EXPECT_TRUE(fs::exists(folder / "out.frames.partial/frame_000001.jpg"));
  // An interrupted `dtr build -o more`, before and with its images, and somebody's own.
  for (const char* kept :
       {"more.partial/work/lock", "more.partial/images/a.png", "more.partial/x"}) {
    leave(kept);
    EXPECT_THAT(MessageOf<UsageError>([&] { WriteCapture(capture, folder / "more"); }),
                HasSubstr("expected nothing or an unfinished capture"));
    EXPECT_TRUE(fs::exists(folder / kept));
    fs::remove_all(folder / "more.partial");
  }
}

TEST(WriteCapture, OneProcessAtATime) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  const Capture capture = Ingest(folder / "photos");
  SilentProgress progress;
  {
    CaptureWriter writer(folder / "out", {});
    EXPECT_FALSE(fs::exists(folder / "out.partial"));  // nothing is made before it is needed
    WriteFileAtomically(writer.Open() / "index.html", "a page");
    EXPECT_THAT(MessageOf<UsageError>([&] { WriteCapture(capture, folder / "out"); }),
                HasSubstr("another process is writing this capture"));
    writer.Write(capture, progress);
  }
  EXPECT_TRUE(fs::exists(folder / "out/index.html"));
  { CaptureWriter(folder / "given up", {}).Open(); }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2);  // photos and out
}

TEST(WriteCapture, AReplacementCutOffHalfWayGivesTheOldCaptureBack) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  const Capture capture = Ingest(folder / "photos");
  WriteCapture(capture, folder / "out");
  const std::string list = ReadFile(folder / "out/capture.json", kFileLimit);
  const auto mark = [&](const std::string& name) { std::ofstream(folder / name / "capture.lock"); };
  // Killed before the old one was moved aside, and between the two renames.
  mark("out");
  { EXPECT_THROW(CaptureWriter(folder / "out", {}), UsageError); }
  EXPECT_FALSE(fs::exists(folder / "out/capture.lock"));
  mark("out");
  fs::rename(folder / "out", folder / "out.replaced");
  { EXPECT_THROW(CaptureWriter(folder / "out", {}), UsageError); }
  EXPECT_EQ(ReadFile(folder / "out/capture.json", kFileLimit), list);
  EXPECT_FALSE(fs::exists(folder / "out/capture.lock"));
  // Killed after both: the new one stays.
  fs::copy(folder / "out", folder / "out.replaced", fs::copy_options::recursive);
  mark("out.replaced");
  mark("out");
  { EXPECT_THROW(CaptureWriter(folder / "out", {}), UsageError); }
  EXPECT_FALSE(fs::exists(folder / "out.replaced"));
  EXPECT_EQ(ReadCapture(folder / "out").photos.size(), 3u);
  // Somebody's capture of that name is not ours to delete.
  fs::copy(folder / "out", folder / "out.replaced", fs::copy_options::recursive);
  { EXPECT_THROW(CaptureWriter(folder / "out", {}), UsageError); }
  EXPECT_TRUE(fs::exists(folder / "out.replaced/capture.json"));
  EXPECT_THAT(MessageOf<UsageError>([&] { CaptureWriter(folder / "out", {.replace = true}); }),
              HasSubstr("out.replaced: expected nothing"));
  // An empty folder in its place is no capture; the old one comes back. Another one stays, both do.
  mark("out.replaced");
  fs::remove_all(folder / "out");
  fs::create_directories(folder / "out");
  { EXPECT_THROW(CaptureWriter(folder / "out", {}), UsageError); }
  EXPECT_EQ(ReadFile(folder / "out/capture.json", kFileLimit), list);
  mark("out");
  fs::rename(folder / "out", folder / "out.replaced");
  fs::create_directories(folder / "out/thesis");
  { EXPECT_THROW(CaptureWriter(folder / "out", {.replace = true}), UsageError); }
  EXPECT_TRUE(fs::exists(folder / "out.replaced/capture.json"));
  EXPECT_TRUE(fs::exists(folder / "out/thesis"));
}

TEST(ReadCapture, NestingThatWouldFillTheStackIsRejected) {
  const std::string deep(1 << 20, '[');
  EXPECT_THAT(MessageOf<Error>([&] { CaptureFromJson(deep, "capture.json"); }),
              HasSubstr("capture.json: expected at most 64 levels of nesting"));
}

TEST(ReadCapture, EveryTruncationIsACleanError) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  WriteCapture(Ingest(folder / "photos"), folder / "out");
  const std::string whole = ReadFile(folder / "out/capture.json", kFileLimit);
  ASSERT_NO_THROW(CaptureFromJson(whole, "whole"));
  for (size_t length = 0; length + 1 < whole.size(); ++length) {  // the last byte is a line end
    ASSERT_THROW(CaptureFromJson(whole.substr(0, length), "cut"), Error) << length;
  }
}

TEST(ReadCapture, NamesTheFieldThatIsWrong) {
  const TemporaryFolder folder;
  FillWithPhotos(folder / "photos");
  WriteCapture(Ingest(folder / "photos"), folder / "out");
  const std::string whole = ReadFile(folder / "out/capture.json", kFileLimit);
  const auto message_with = [&](const std::string& from, const std::string& to) {
    std::string changed = whole;
    const size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    std::ofstream(folder / "out/capture.json", std::ios::binary) << changed;  // no sync to disk
    return MessageOf<Error>([&] { ReadCapture(folder / "out"); });
  };
  EXPECT_THAT(message_with("\"version\": 1", "\"version\": 2"), HasSubstr("version"));
  EXPECT_THAT(message_with("dtr-capture", "other"), HasSubstr("format"));
  EXPECT_THAT(message_with("\"width_px\": 48", "\"width_px\": -48"),
              HasSubstr("photos[0].width_px"));
  EXPECT_THAT(message_with("\"width_px\": 48", "\"width_px\": 1e99"), HasSubstr("width_px"));
  EXPECT_THAT(message_with("\"exif_orientation\": 1", "\"exif_orientation\": 9"),
              HasSubstr("exif_orientation"));
  EXPECT_THAT(message_with("images/A_b.jpg", "../photos/A b.JPG"), HasSubstr("photos[0].file"));
  EXPECT_THAT(message_with("images/A_b.jpg", "/etc/passwd"), HasSubstr("photos[0].file"));
  EXPECT_THAT(message_with("images/A_b.jpg", "images/gone.jpg"), HasSubstr("gone.jpg"));
  EXPECT_THAT(message_with("\"id\": \"A_b\"", "\"id\": \"../A\""), HasSubstr("photos[0].id"));
  EXPECT_THAT(message_with("\"id\": \"A_b\"", "\"id\": \"left_plain\""), HasSubstr("twice"));
  EXPECT_THAT(message_with("\"name\": \"A b.JPG\"", "\"name\": \"z.JPG\""), HasSubstr("order"));
  EXPECT_THAT(message_with("\"focal_prior_px\": ", "\"focal_prior_px\": -"),
              HasSubstr("focal_prior_px"));
  EXPECT_THAT(message_with("\"photos\": [", "\"photos\": 3, \"x\": ["), HasSubstr("a list"));
  EXPECT_THAT(message_with("\"make\"", "\"mark\""), HasSubstr("\"make\""));
}

TEST(IngestPhotos, SetsAndCapturesBelowThePhotosAreNoPhotos) {
  const TemporaryFolder folder;
  FillWithPhotos(folder.path());
  WriteCapture(Ingest(folder.path()), folder / "z capture");
  fs::create_directories(folder / "scene.dtr/images");
  io::WriteImage(folder / "scene.dtr/images/1.png", NoisePhoto(8, 8, 1));
  fs::create_directories(folder / "scene2.dtr.partial/images");
  io::WriteImage(folder / "scene2.dtr.partial/images/1.png", NoisePhoto(8, 8, 1));
  const Capture capture = Ingest(folder.path());
  EXPECT_EQ(capture.photos.size(), 3u);
  EXPECT_EQ(capture.skipped.size(), 1u);  // text.jpg
  const auto own = std::find_if(capture.contents.ignored.begin(), capture.contents.ignored.end(),
                                [](const auto& ignored) { return ignored.kind == "own_folders"; });
  ASSERT_NE(own, capture.contents.ignored.end());
  EXPECT_GE(own->files, 3) << "of each of the three folders";
}

}  // namespace
}  // namespace dtr::capture
