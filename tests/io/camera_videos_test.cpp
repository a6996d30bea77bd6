// Images of a dynamic set as videos: the same pixels whatever frame is read first, the same bytes
// for any number of threads, and one clear line where a video is not the right one.
#include "dtr/io/camera_videos.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/process.h"
#include "dtr/io/set_io.h"
#include "dtr/io/video_frames.h"
#include "tests/io/small_set.h"
#include "tests/support/message_of.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;
using namespace testing_support;

constexpr int kClipSteps = 13;                    // two videos a camera
constexpr int kClipWidth = 67, kClipHeight = 45;  // odd: no colours are shared between pixels

/// A slope of colours before which a bright square moves.
View ClipView(int camera, int step, ViewRole role = ViewRole::kSource) {
  View view;
  view.id = "t" + std::to_string(1000 + step) + "_cam" + std::to_string(camera);
  view.name = "cam" + std::to_string(camera);
  view.role = role;
  view.camera = PinholeCamera(kClipWidth, kClipHeight, 60, 60, 30, 20);
  view.image = ImageRgb8(kClipWidth, kClipHeight, 3);
  for (int y = 0; y < kClipHeight; ++y) {
    for (int x = 0; x < kClipWidth; ++x) {
      const bool square = x >= 4 * step && x < 4 * step + 9 && y >= 10 && y < 19;
      view.image(x, y, 0) = static_cast<std::uint8_t>(square ? 250 : 3 * x + 10 * camera);
      view.image(x, y, 1) = static_cast<std::uint8_t>(square ? 40 : 5 * y);
      view.image(x, y, 2) = static_cast<std::uint8_t>(square ? 200 - step : 60 + x - y);
    }
  }
  return view;
}

DtrSet WriteClips(const fs::path& target, const VideoQuality& quality, int threads = 1) {
  SetWriter writer(target, kFingerprint, false);
  DtrSet set = EmptySet();
  set.frames.resize(kClipSteps);
  for (int step = 0; step < kClipSteps; ++step) {
    for (int camera = 0; camera < 3; ++camera) {
      View view = ClipView(camera, step, camera < 2 ? ViewRole::kSource : ViewRole::kHeldOut);
      writer.WriteView(view, set.unit);
      view.image = {};
      set.frames[static_cast<size_t>(step)].views.push_back(std::move(view));
    }
  }
  SilentProgress silent;
  OnThreads(threads, [&] {
    return StoreCameraVideos(writer.folder(), writer.work_folder(), set, quality, 1, silent);
  });
  writer.Finish(set);
  return set;
}

ImageRgb8 LoadedImage(const fs::path& set, View view) {
  LoadPixels(set, view, {});
  return view.image;
}

double Psnr(const ImageRgb8& a, const ImageRgb8& b) {
  double sum = 0;
  for (size_t i = 0; i < a.data().size(); ++i) sum += std::pow(a.data()[i] - b.data()[i], 2);
  return 10 * std::log10(255 * 255 / (sum / static_cast<double>(a.data().size())));
}

class CameraVideos : public ::testing::Test {
 protected:
  void SetUp() override {
    if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "ffmpeg is not installed";
  }
  TemporaryFolder folder_;
  fs::path set_ = folder_ / "clips.dtr";
};

TEST_F(CameraVideos, LosslessOnesGiveEveryPixelBack) {
  const DtrSet set = WriteClips(set_, {.lossless = true});
  for (const Frame& frame : set.frames) {
    for (const View& view : frame.views) {
      const int step = std::stoi(view.id.substr(1, 4)) - 1000, camera = view.name.back() - '0';
      EXPECT_EQ(LoadedImage(set_, view), ClipView(camera, step).image) << view.id;
      EXPECT_EQ(view.image_frame.has_value(), view.role == ViewRole::kSource);
    }
  }
  EXPECT_FALSE(fs::exists(set_ / "images"));
  EXPECT_TRUE(fs::exists(set_ / "held_out/images/t1000_cam2.png"));
  EXPECT_THAT(VerifySet(set_), IsEmpty());
  EXPECT_EQ(LoadSet(set_).frames.size(), size_t{kClipSteps});
}

TEST_F(CameraVideos, AFrameIsTheSameWhicheverIsReadFirst) {
  const DtrSet set = WriteClips(set_, {.crf = 20});
  std::vector<ImageRgb8> forwards;
  for (const Frame& frame : set.frames) forwards.push_back(LoadedImage(set_, frame.views[0]));
  for (size_t step = kClipSteps; step-- > 0;) {
    EXPECT_EQ(LoadedImage(set_, set.frames[step].views[0]), forwards[step]);
    constexpr double kGoodDb = 38;  // of rate factor 20; another frame has 20
    EXPECT_GT(Psnr(forwards[step], ClipView(0, static_cast<int>(step)).image), kGoodDb) << step;
  }
}

TEST_F(CameraVideos, BytesAreTheSameForAnyNumberOfThreads) {
  WriteClips(set_, {.crf = 25}, 1);
  WriteClips(folder_ / "other.dtr", {.crf = 25}, 3);
  EXPECT_EQ(Contents(set_), Contents(folder_ / "other.dtr"));
}

TEST_F(CameraVideos, DamageAndEveryTruncatedPrefixAreErrors) {
  const DtrSet set = WriteClips(set_, {.crf = 25});
  View view = set.frames[2].views[1];
  const fs::path file = set_ / view.image_file->path;
  testing::ExpectEveryPrefixIsAnError(file, 97, [&] { LoadPixels(set_, view, {}); });
  std::string bytes = ReadFile(file, 1 << 24);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  WriteFileAtomically(file, bytes);
  EXPECT_THAT(testing::MessageOf<Error>([&] { LoadPixels(set_, view, {}); }),
              HasSubstr("expected the content that the set records, found another"));
}

TEST_F(CameraVideos, AFrameBeyondTheEndAndAnotherSizeAreNamed) {
  const DtrSet set = WriteClips(set_, {.crf = 25});
  View view = set.frames[12].views[0];
  view.image_frame = 3;
  EXPECT_THAT(testing::MessageOf<Error>([&] { LoadPixels(set_, view, {}); }),
              HasSubstr("video/t1010_cam0.mp4: expected a frame 3, found 3 frames"));
  view.image_frame = 0;
  view.camera = PinholeCamera(kClipWidth + 1, kClipHeight, 60, 60, 30, 20);
  EXPECT_THAT(testing::MessageOf<Error>([&] { LoadPixels(set_, view, {}); }),
              HasSubstr("expected the view's 68x45 pixels, found 67x45"));
}

TEST_F(CameraVideos, AnImageIsNoVideo) {
  const DtrSet set = WriteClips(set_, {.lossless = true});
  View view = set.frames[0].views[2];
  view.image_frame = 0;
  EXPECT_THAT(testing::MessageOf<Error>([&] { LoadPixels(set_, view, {}); }),
              HasSubstr("FFmpeg cannot read it as a video"));
}

TEST_F(CameraVideos, FrameNumbersInSetJsonAreChecked) {
  WriteClips(set_, {.crf = 30});
  const std::string text = ReadFile(set_ / "set.json", 1 << 24);
  EXPECT_THAT(text, HasSubstr("\"format_version\": 2,"));
  for (const char* bad : {"-1", "256", "0.5", "\"0\""}) {
    std::string edited = text;
    const std::string frame = "\"frame\": 3";
    edited.replace(edited.find(frame), frame.size(), std::string("\"frame\": ") + bad);
    WriteFileAtomically(set_ / "set.json", edited);
    EXPECT_THAT(testing::MessageOf<Error>([&] { ReadSet(set_); }), HasSubstr("image.frame")) << bad;
  }
}

TEST(VideoColours, GoThereAndBackWithinTwoLevels) {
  // Rounding luma and two differences of colour to 8 bits: 0.5 + 0.5 x 1.86 levels, rounded once
  // more.
  constexpr int kMost = 2;
  Random random(1);
  ImageRgb8 image(300, 200, 3);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(random.Index(256));
  const std::vector<std::uint8_t> bytes = YCbCrFromRgb(image);
  const size_t plane = 300 * 200;
  const std::array<const std::uint8_t*, 3> planes{bytes.data(), &bytes[plane], &bytes[2 * plane]};
  const std::array<int, 3> rows{300, 300, 300};
  const ImageRgb8 back = RgbFromYCbCr(planes, rows, 300, 200);
  for (size_t i = 0; i < image.data().size(); ++i) {
    ASSERT_LE(std::abs(int{image.data()[i]} - int{back.data()[i]}), kMost) << i;
  }
}

TEST(VideoColours, GreysStayExactly) {
  ImageRgb8 image(256, 1, 3);
  for (int x = 0; x < 256; ++x) {
    for (int c = 0; c < 3; ++c) image(x, 0, c) = static_cast<std::uint8_t>(x);
  }
  const std::vector<std::uint8_t> bytes = YCbCrFromRgb(image);
  EXPECT_EQ(bytes[200], 200);
  EXPECT_EQ(bytes[256 + 200], 128);
  const std::array<const std::uint8_t*, 3> planes{bytes.data(), &bytes[256], &bytes[512]};
  EXPECT_EQ(RgbFromYCbCr(planes, std::array{256, 256, 256}, 256, 1), image);
}

TEST(VideoQuality, WordsAreRateFactorsOrLossless) {
  EXPECT_TRUE(VideoQualityFrom("lossless").lossless);
  EXPECT_EQ(VideoQualityFrom("23").crf, 23);
  for (const char* bad : {"", "0", "52", "-3", "18.5", "18x", "best"}) {
    EXPECT_THROW(VideoQualityFrom(bad), UsageError) << bad;
  }
}

}  // namespace
}  // namespace dtr::io
