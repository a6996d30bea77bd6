// Videos whose pixels are known, made by FFmpeg: what the file says of its frames is applied.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "capture/video/frames.h"
#include "capture/video/ingest_video.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "dtr/io/video.h"
#include "tests/capture/photo_files.h"
#include "tests/capture/video/ffmpeg_videos.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::DataFolder;
using dtr::testing::TemporaryFolder;
using testing::Arguments;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using testing::RunFfmpeg;
using testing::WriteCounted;

constexpr int kW = 96, kH = 64;

// Blocks of different colours, without any symmetry.
ImageRgb8 Truth() {
  ImageRgb8 image(kW, kH, 3);
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      image(x, y, 0) = static_cast<std::uint8_t>(40 + 160 * (x / 32) / 2);
      image(x, y, 1) = static_cast<std::uint8_t>(40 + 160 * (y / 32));
      image(x, y, 2) = static_cast<std::uint8_t>(x < 16 && y < 16 ? 220 : 60);
    }
  }
  return image;
}

std::vector<ImageRgb8> FramesOf(const fs::path& video) {
  std::vector<ImageRgb8> frames;
  ForEachFrame(video, [&](int, const ImageRgb8& frame) {
    frames.push_back(frame);
    return true;
  });
  return frames;
}

double Rmse(const ImageRgb8& a, const ImageRgb8& b) {
  if (a.width() != b.width() || a.height() != b.height()) return 255;
  double sum = 0;
  for (size_t i = 0; i < a.data().size(); ++i) sum += std::pow(a.data()[i] - b.data()[i], 2);
  return std::sqrt(sum / static_cast<double>(a.data().size()));
}

// Five frames of the truth, lossless.
void WriteTruthVideo(const TemporaryFolder& folder, const std::string& name,
                     const Arguments& more = {}) {
  io::WritePng(folder / "truth.png", Truth());
  Arguments arguments{"-loop",     "1", "-framerate", "10",         "-i",  "truth.png",
                      "-frames:v", "5", "-c:v",       "libx264rgb", "-qp", "0"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  arguments.push_back(name);
  RunFfmpeg(folder.path(), arguments);
}

// The video with another matrix (a, b, c, d) in its track header (ISO 14496-12, 8.3.2).
void SetMatrix(const fs::path& from, const fs::path& to, const std::array<double, 4>& axes) {
  std::string bytes = ReadFile(from, 1 << 24);
  const size_t at = bytes.find("tkhd") + 4 + 40;
  const std::array<double, 9> matrix{axes[0], axes[1], 0, axes[2], axes[3], 0, 0, 0, 16384};
  for (size_t i = 0; i < matrix.size(); ++i) {
    const auto fixed = static_cast<std::uint32_t>(static_cast<std::int32_t>(matrix[i] * 65536));
    for (size_t k = 0; k < 4; ++k) {
      bytes[at + 4 * i + k] = static_cast<char>((fixed >> (24 - 8 * k)) & 255);
    }
  }
  WriteFileAtomically(to, bytes);
}

TEST(VideoTruth, PhoneVideosStandUpright) {
  for (const char* angle : {"90", "180", "270"}) {
    const fs::path folder = DataFolder() / "field/video_rotation";
    const fs::path video = folder / (std::string("rot") + angle + ".mp4");
    DTR_REQUIRE_DATA(video);
    const ImageRgb8 expected = io::ReadImage(folder / (std::string("expected_") + angle + ".png"));
    EXPECT_LT(Rmse(FramesOf(video).at(0), expected), 0.01 * 255) << angle;
  }
}

TEST(VideoTruth, RotationsAndMirroringsOfTheTrackAreApplied) {
  const TemporaryFolder folder;
  WriteTruthVideo(folder, "plain.mp4");
  EXPECT_EQ(FramesOf(folder / "plain.mp4").at(0), Truth());
  const std::array<std::array<double, 4>, 8> matrices{{{1, 0, 0, 1},
                                                       {-1, 0, 0, 1},
                                                       {-1, 0, 0, -1},
                                                       {1, 0, 0, -1},
                                                       {0, 1, 1, 0},
                                                       {0, 1, -1, 0},
                                                       {0, -1, -1, 0},
                                                       {0, -1, 1, 0}}};
  for (size_t i = 0; i < matrices.size(); ++i) {
    SetMatrix(folder / "plain.mp4", folder / "turned.mp4", matrices[i]);
    const auto expected = io::ApplyExifOrientation(Truth(), static_cast<int>(i) + 1);
    EXPECT_EQ(FramesOf(folder / "turned.mp4").at(0), expected) << "EXIF orientation " << i + 1;
    // QuickTime has the same matrix.
    RunFfmpeg(folder.path(), {"-i", "turned.mp4", "-c", "copy", "turned.mov"});
    EXPECT_EQ(FramesOf(folder / "turned.mov").at(0), expected) << "EXIF orientation " << i + 1;
  }
  SetMatrix(folder / "plain.mp4", folder / "odd.mp4", {0.7, 0.7, -0.7, 0.7});
  VideoReader odd(folder / "odd.mp4");
  ASSERT_TRUE(odd.Next());
  EXPECT_EQ(odd.Picture(), Truth());
  EXPECT_THAT(odd.remarks(), Contains(HasSubstr("no multiple of 90 degrees")));
}

// Y, Cb, Cr of one colour as samples of so many bits (ITU-T H.273, 8.3).
std::array<int, 3> Samples(const std::array<double, 3>& rgb, double kr, double kb, bool full,
                           int bits) {
  const double y = kr * rgb[0] + (1 - kr - kb) * rgb[1] + kb * rgb[2];
  const double cb = (rgb[2] - y) / (2 - 2 * kb), cr = (rgb[0] - y) / (2 - 2 * kr);
  const double unit = 1 << (bits - 8), most = (1 << bits) - 1;
  const auto round = [](double value) { return static_cast<int>(std::lround(value)); };
  if (full) return {round(y * most), round(cb * most + 128 * unit), round(cr * most + 128 * unit)};
  return {round((219 * y + 16) * unit), round((224 * cb + 128) * unit),
          round((224 * cr + 128) * unit)};
}

// One frame of one colour; `tags`: what the file says.
void WriteFlat(const TemporaryFolder& folder, const std::string& name, std::array<int, 3> samples,
               int bits, const Arguments& tags, int width = 64, int height = 48) {
  std::string bytes;
  for (int plane = 0; plane < 3; ++plane) {
    const int count = width * height / (plane == 0 ? 1 : 4);
    for (int i = 0; i < count; ++i) {
      const int value = samples[static_cast<size_t>(plane)];
      bytes += static_cast<char>(value & 255);
      if (bits > 8) bytes += static_cast<char>(value >> 8);
    }
  }
  WriteFileAtomically(folder / "flat.yuv", bytes);
  const std::string format = bits > 8 ? "yuv420p10le" : "yuv420p";
  Arguments arguments{"-f",   "rawvideo", "-pix_fmt",
                      format, "-s",       std::to_string(width) + "x" + std::to_string(height)};
  arguments.insert(arguments.end(), tags.begin(), tags.end());
  arguments.insert(arguments.end(), {"-i", "flat.yuv", "-c:v", bits > 8 ? "libx265" : "libx264"});
  if (bits > 8) {
    arguments.insert(arguments.end(),
                     {"-x265-params", "lossless=1:log-level=none", "-tag:v", "hvc1"});
  } else {
    arguments.insert(arguments.end(), {"-qp", "0"});
  }
  arguments.insert(arguments.end(), {"-pix_fmt", format});
  arguments.insert(arguments.end(), tags.begin(), tags.end());
  arguments.push_back(name);
  RunFfmpeg(folder.path(), arguments);
}

// `levels`: what the rounding of the samples and of the result allows.
void ExpectColour(const ImageRgb8& image, const std::array<double, 3>& rgb, double levels,
                  const std::string& what) {
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(image(image.width() / 2, image.height() / 2, static_cast<int>(c)), 255 * rgb[c],
                levels)
        << what << ", channel " << c;
  }
}

TEST(VideoTruth, ColourMatrixAndRangeAreThoseTheFileStates) {
  const TemporaryFolder folder;
  const std::array<double, 3> rgb{0.8, 0.25, 0.1};
  struct Matrix {
    const char* name;
    double kr, kb;
  };
  for (const Matrix& matrix :
       {Matrix{"smpte170m", 0.299, 0.114}, Matrix{"bt709", 0.2126, 0.0722}}) {
    for (const bool full : {false, true}) {
      for (const int bits : {8, 10}) {
        WriteFlat(folder, "flat.mp4", Samples(rgb, matrix.kr, matrix.kb, full, bits), bits,
                  {"-colorspace", matrix.name, "-color_range", full ? "pc" : "tv"});
        ExpectColour(
            FramesOf(folder / "flat.mp4").at(0), rgb, 2.1,
            std::string(matrix.name) + (full ? " full " : " limited ") + std::to_string(bits));
      }
    }
  }
}

TEST(VideoTruth, WhatTheFileDoesNotStateIsTakenAsPlayersDo) {
  const TemporaryFolder folder;
  const std::array<double, 3> rgb{0.8, 0.25, 0.1};
  WriteFlat(folder, "small.mp4", Samples(rgb, 0.299, 0.114, false, 8), 8, {});
  ExpectColour(FramesOf(folder / "small.mp4").at(0), rgb, 2.1, "BT.601");
  WriteFlat(folder, "large.mp4", Samples(rgb, 0.2126, 0.0722, false, 8), 8, {}, 1280, 720);
  VideoReader large(folder / "large.mp4");
  ASSERT_TRUE(large.Next());
  ExpectColour(large.Picture(), rgb, 2.1, "BT.709");
  EXPECT_THAT(large.remarks(), Contains(HasSubstr("does not say its colour matrix")));
}

TEST(VideoTruth, VideosOfColoursThatAreNotConvertedAreAnError) {
  const TemporaryFolder folder;
  WriteFlat(folder, "flat.mp4", {128, 128, 128}, 8, {"-colorspace", "ictcp"});
  EXPECT_THAT(MessageOf<Error>([&] { FramesOf(folder / "flat.mp4"); }),
              HasSubstr("flat.mp4: frame 0: the colour matrix ictcp is not supported"));
}

TEST(VideoTruth, AFileOfSoundAloneIsNoVideo) {
  const TemporaryFolder folder;
  RunFfmpeg(folder.path(), {"-f", "lavfi", "-i", "sine=duration=0.2", "sound.mp4"});
  EXPECT_THAT(MessageOf<Error>([&] { FramesOf(folder / "sound.mp4"); }),
              HasSubstr("sound.mp4: holds no video track that FFmpeg decodes"));
}

TEST(VideoTruth, WhatWeWriteIsStatedAndReadBack) {
  const TemporaryFolder folder;
  ImageRgb8 image(1280, 720, 3);
  for (size_t i = 0; i < image.data().size(); i += 3) {
    image.data()[i] = 204;
    image.data()[i + 1] = 64;
    image.data()[i + 2] = 26;
  }
  io::VideoWriter writer(folder / "out.mp4", 10);
  for (int i = 0; i < 3; ++i) writer.Add(image);
  writer.Finish(SilentProgress());
  VideoReader video(folder / "out.mp4");
  ASSERT_TRUE(video.Next());
  ExpectColour(video.Picture(), {0.8, 64 / 255.0, 26 / 255.0}, 3.1, "our own");
  EXPECT_THAT(video.remarks(), IsEmpty());
  ProcessOptions probe;
  probe.log_file = folder / "probe.txt";
  ASSERT_TRUE(
      RunProcess({"ffprobe", "-v", "error", "-show_streams", (folder / "out.mp4").string()}, probe)
          .Ok());
  const std::string stated = ReadFile(folder / "probe.txt", 1 << 20);
  for (const char* colours : {"color_range=tv", "color_space=bt709", "color_primaries=bt709",
                              "color_transfer=iec61966-2-1"}) {
    EXPECT_THAT(stated, HasSubstr(colours));
  }
}

TEST(VideoTruth, HdrReferenceWhiteComesNearWhite) {
  const TemporaryFolder folder;
  // 75 % of HLG and 58 % of PQ are 203 cd/m2 (ITU-R BT.2408); 0.8 + 0.2 (1 - 1 / e) of light is
  // 0.967 of sRGB.
  for (const auto& [transfer, number] : {std::pair("arib-std-b67", 0.75), {"smpte2084", 0.5807}}) {
    WriteFlat(folder, "hdr.mp4", Samples({number, number, number}, 0.2627, 0.0593, false, 10), 10,
              {"-colorspace", "bt2020nc", "-color_primaries", "bt2020", "-color_trc", transfer,
               "-color_range", "tv"});
    VideoReader video(folder / "hdr.mp4");
    ASSERT_TRUE(video.Next());
    ExpectColour(video.Picture(), {0.967, 0.967, 0.967}, 1.1, transfer);
    EXPECT_THAT(video.remarks(), Contains(HasSubstr("HDR (")));
  }
}

TEST(VideoTruth, WideGamutIsConverted) {
  const TemporaryFolder folder;
  // BT.709's red, green and blue in halves, in the primaries of BT.2020 (ITU-R BT.2087):
  // linear light 0.5 x (0.6274, 0.0691, 0.0164) for red.
  const auto coded = [](double light) { return 1.055 * std::pow(light, 1 / 2.4) - 0.055; };
  const std::array<double, 3> red{coded(0.5 * 0.6274), coded(0.5 * 0.0691), coded(0.5 * 0.0164)};
  WriteFlat(folder, "wide.mp4", Samples(red, 0.2627, 0.0593, false, 10), 10,
            {"-colorspace", "bt2020nc", "-color_primaries", "bt2020", "-color_trc", "bt2020-10",
             "-color_range", "tv"});
  // 12 levels at 0: what 10 bits leave of the two small channels.
  const ImageRgb8 image = FramesOf(folder / "wide.mp4").at(0);
  EXPECT_NEAR(image(5, 5, 0), 255 * coded(0.5), 2);
  EXPECT_LT(image(5, 5, 1), 12);
  EXPECT_LT(image(5, 5, 2), 12);
}

TEST(VideoTruth, PixelsThatAreNotSquareAreScaledAlsoWhereTheVideoIsRotated) {
  const TemporaryFolder folder;
  WriteTruthVideo(folder, "wide.mp4", {"-vf", "setsar=4/3"});
  VideoReader wide(folder / "wide.mp4");
  ASSERT_TRUE(wide.Next());
  const ImageRgb8 image = wide.Picture();
  EXPECT_EQ(image.width(), 128);
  EXPECT_EQ(image.height(), kH);
  EXPECT_EQ(image(10, 10, 2), 220);
  EXPECT_EQ(image(30, 10, 2), 60);
  EXPECT_THAT(wide.remarks(), Contains("its pixels are not square: frames of 96x64 are scaled to "
                                       "128x64"));
  SetMatrix(folder / "wide.mp4", folder / "turned.mp4", {0, 1, -1, 0});
  EXPECT_EQ(FramesOf(folder / "turned.mp4").at(0), io::ApplyExifOrientation(image, 6));
}

TEST(VideoTruth, InterlacedFramesAreDeinterlaced) {
  const TemporaryFolder folder;
  // An edge that moves by 8 px from field to field, top field first.
  constexpr int kFrames = 6;
  std::string bytes;
  for (int frame = 0; frame < kFrames; ++frame) {
    for (int y = 0; y < kH; ++y) {
      const int edge = 8 * (2 * frame + y % 2) + 8;
      for (int x = 0; x < kW; ++x) bytes += static_cast<char>(x < edge ? 200 : 50);
    }
    bytes += std::string(kW * kH / 2, static_cast<char>(128));
  }
  WriteFileAtomically(folder / "fields.yuv", bytes);
  RunFfmpeg(
      folder.path(),
      {"-f",  "rawvideo", "-pix_fmt",   "yuv420p",     "-s",           "96x64", "-r",
       "25",  "-i",       "fields.yuv", "-vf",         "setfield=tff", "-c:v",  "libx264",
       "-qp", "0",        "-flags",     "+ilme+ildct", "-x264opts",    "tff=1", "fields.mp4"});
  VideoReader video(folder / "fields.mp4");
  int combed = 0;
  while (video.Next()) {
    const ImageRgb8 image = video.Picture();
    for (int y = 2; y + 2 < kH; ++y) {
      for (int x = 0; x < kW; ++x) {
        const int above = image(x, y, 1) - image(x, y - 1, 1);
        const int below = image(x, y, 1) - image(x, y + 1, 1);
        if (above * below > 50 * 50) ++combed;
      }
    }
  }
  EXPECT_EQ(video.number() + 1, kFrames);
  EXPECT_LT(combed, kFrames * 8 * kH / 50);  // as stored it is every pixel of 8 columns a frame
  EXPECT_THAT(video.remarks(), Contains("interlaced frames are deinterlaced"));
  EXPECT_EQ(video.WhyIncomplete(), "");
}

// What a file holds says how to decode it, not its name.
TEST(VideoTruth, FilesOfCamcordersPhonesAndActionCamerasAreRead) {
  const TemporaryFolder folder;
  struct Kind {
    const char* name;
    Arguments how;
  };
  const Arguments h264{"-c:v", "libx264", "-qp", "0"};
  const Arguments blocks{"-r", "25", "-b:v", "20M", "-c:v"};
  const auto with = [](Arguments all, const Arguments& more) {
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const Kind kinds[] = {
      {"plain.ts", h264},
      {"00001.MTS", with(h264, {"-f", "mpegts", "-mpegts_m2ts_mode", "1"})},
      {"00002.m2ts", with(h264, {"-mpegts_m2ts_mode", "1"})},
      {"program.mpg", with(blocks, {"mpeg2video", "-f", "vob"})},
      {"video.mpg", with(blocks, {"mpeg2video", "-f", "mpeg2video"})},
      {"video.mpeg", with(blocks, {"mpeg1video", "-f", "mpeg1video"})},
      {"phone.3gp", with(h264, {"-f", "3gp"})},
      {"old.wmv", with(blocks, {"wmv2"})},
      {"old.qt", with(blocks, {"mjpeg", "-f", "mov"})},
      {"GL010001.LRV", with(h264, {"-f", "mp4"})},
      {"VID_1.insv", with(h264, {"-f", "mp4"})},
      {"frames.mj2",
       {"-c:v", "jpeg2000", "-f", "mov", "-movflags",
        "frag_keyframe+empty_moov+default_base_moof"}},
  };
  for (const Kind& kind : kinds) {
    WriteCounted(folder, kind.name, 12, kind.how);
    if (kind.name == std::string("frames.mj2")) {  // ISO 15444-3: a signature stands first
      const std::string mov = ReadFile(folder / kind.name, 1 << 24);
      WriteFileAtomically(folder / kind.name, std::string("\0\0\0\x0cjP  \r\n\x87\n", 12) + mov);
    }
    VideoReader video(folder / kind.name);
    int frames = 0;
    while (video.Next()) ++frames;
    EXPECT_GE(frames, 12) << kind.name;
    EXPECT_EQ(video.WhyIncomplete(), "") << kind.name;
  }
  // A transport stream may begin anywhere, with video before its tables.
  const std::string whole = ReadFile(folder / "plain.ts", 1 << 24);
  WriteFileAtomically(folder / "later.mts", whole.substr(2 * 188, 188) + whole);
  EXPECT_EQ(FramesOf(folder / "later.mts").size(), 12u);
}

TEST(VideoTruth, FramesThatAnEditListHidesAreNeitherShownNorMissed) {
  const TemporaryFolder folder;
  WriteCounted(folder, "whole.mp4", 20, {"-c:v", "libx264", "-qp", "0", "-g", "20", "-bf", "0"});
  RunFfmpeg(folder.path(), {"-ss", "0.75", "-i", "whole.mp4", "-c", "copy", "tail.mp4"});
  VideoReader video(folder / "tail.mp4");
  ASSERT_TRUE(video.Next());
  const ImageRgb8 first = video.Picture();
  EXPECT_NEAR(first(5, 5, 0), (20 + 10 * 8 - 16) * 255 / 219.0, 12);  // frame 7 or 8 by rounding
  EXPECT_NEAR(video.time_s(), 0, 0.1);
  while (video.Next()) {
  }
  EXPECT_NEAR(video.number() + 1, 12, 1);
  EXPECT_EQ(video.WhyIncomplete(), "");
}

TEST(VideoTruth, FramesOfVariableRateHaveTheirOwnTimesAndNoneIsMissed) {
  const TemporaryFolder folder;
  for (const char* name : {"some.mkv", "some.mp4"}) {
    WriteCounted(
        folder, name, 20,
        {"-vf", "select='lt(n,10)+not(mod(n,5))'", "-vsync", "vfr", "-c:v", "libx264", "-qp", "0"});
    VideoReader video(folder / name);
    std::vector<double> times_s;
    while (video.Next()) times_s.push_back(video.time_s());
    ASSERT_EQ(times_s.size(), 12u) << name;
    EXPECT_NEAR(times_s[9], 0.9, 2e-3) << name;
    EXPECT_NEAR(times_s[10], 1.0, 2e-3) << name;
    EXPECT_NEAR(times_s[11], 1.5, 2e-3) << name;
    EXPECT_EQ(video.WhyIncomplete(), "") << name;
  }
}

TEST(VideoTruth, AVideoWhoseSizeChangesEndsThereAndSaysSo) {
  const TemporaryFolder folder;
  WriteTruthVideo(folder, "a.ts", {"-pix_fmt", "rgb24"});
  WriteCounted(folder, "b.ts", 5, {"-c:v", "libx264", "-qp", "0"});
  WriteFileAtomically(folder / "joined.mp4",
                      ReadFile(folder / "a.ts", 1 << 24) + ReadFile(folder / "b.ts", 1 << 24));
  SilentProgress progress;
  fs::create_directories(folder / "frames");
  const Capture capture =
      IngestVideos({folder / "joined.mp4"}, {.every = 1}, folder / "frames", progress);
  EXPECT_EQ(capture.photos.size(), 5u);
  ASSERT_EQ(capture.skipped.size(), 1u);
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("frames from 5 on: they are 64x48"));
}

TEST(VideoTruth, SynchronisedVideosOfDifferentMomentsAreRemarked) {
  const TemporaryFolder folder;
  WriteCounted(folder, "left.mkv", 20, {"-c:v", "libx264", "-qp", "0"});
  WriteCounted(folder, "right.mkv", 20,
               {"-vf", "select='lt(n,5)+gt(n,7)'", "-vsync", "vfr", "-c:v", "libx264", "-qp", "0"});
  SilentProgress progress;
  fs::create_directories(folder / "frames");
  const Capture capture =
      IngestVideos({folder / "left.mkv", folder / "right.mkv"}, {.every = 1, .synchronised = true},
                   folder / "frames", progress);
  ASSERT_EQ(capture.remarks.size(), 1u);
  EXPECT_THAT(capture.remarks[0].text, HasSubstr("frame 5 is shown at 0.500 s, that of right.mkv "
                                                 "at 0.800 s"));
}

}  // namespace
}  // namespace dtr::capture
