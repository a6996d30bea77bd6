// What an image takes in memory, counted: FrameBytes must not be less.
#include "dtr/render/frame_memory.h"

#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/random.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/render/finish_image.h"
#include "dtr/render/frame.h"
#include "tests/fuzz/memory_watch.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr {
namespace {

constexpr int kWidth = 1200, kHeight = 900;
const PinholeCamera kNovel(kWidth, kHeight, 1000, 1000, kWidth / 2.0, kHeight / 2.0);
// Tables, names of files, and OpenImageIO's own.
constexpr double kConstantBytes = 4e6;

/// Noise, which no coder makes smaller, with holes of all sizes.
RenderResult NoiseWithHoles() {
  Random random(3);
  RenderResult result = EmptyResult(kNovel);
  for (std::uint8_t& value : result.image.data()) {
    value = static_cast<std::uint8_t>(random.Index(256));
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (x > kWidth / 2 && y > kHeight / 2) continue;
      if (random.Index(4) == 0) continue;
      result.coverage(x, y) = 255;
      result.depth(x, y) = static_cast<float>(random.Uniform(1, 9));
    }
  }
  return result;
}

class FrameMemory : public ::testing::Test {
 protected:
  /// `work` gets a result whose memory is counted.
  template <typename Work>
  static double BytesPerPixel(const Work& work) {
    const RenderResult made = NoiseWithHoles();
    const fuzz::MemoryWatch watch;
    RenderResult result = made;
    work(result);
    return (static_cast<double>(watch.PeakBytes()) - kConstantBytes) / (kWidth * kHeight);
  }
  static double Stated() { return FrameBytes(kWidth, kHeight) / (kWidth * kHeight); }

  const TemporaryFolder folder_;
};

TEST_F(FrameMemory, OfFinishingIsWithinWhatIsStated) {
  const RenderScene scene;
  const double taken = BytesPerPixel([&](RenderResult& result) {
    RenderOptions options = WholeFrames();
    FinishImage(scene, kNovel, Pose(), options, result);
  });
  EXPECT_LE(taken, Stated());
  EXPECT_GT(taken, 0.7 * Stated());  // else images are rejected that would fit
}

TEST_F(FrameMemory, OfWritingIsWithinWhatIsStated) {
  io::WritePng(folder_ / "first.png", ImageRgb8(8, 8, 3));  // sets up what is set up once
  const auto expect = [&](const char* name, const auto& write) {
    EXPECT_LE(BytesPerPixel(write), Stated()) << name;
  };
  expect("png", [&](RenderResult& r) { io::WriteImage(folder_ / "a.png", r.image); });
  expect("alpha",
         [&](RenderResult& r) { io::WriteImageWithAlpha(folder_ / "b.png", r.image, r.coverage); });
  expect("jpg", [&](RenderResult& r) { io::WriteImage(folder_ / "a.jpg", r.image); });
  expect("exr", [&](RenderResult& r) { io::WriteExr(folder_ / "a.exr", r.depth.grid(), false); });
  expect("mask", [&](RenderResult& r) { io::WriteMask(folder_ / "m.png", r.coverage); });
}

TEST_F(FrameMemory, ImagesBeyondTheLimitAreRejectedWithNeedAndLimit) {
  const PinholeCamera large(10000, 10000, 9000, 9000, 5000, 5000);
  const auto ask = [&](bool video, double gb) {
    RequireFrameMemory(large, video, gb, "cam.json: a");
  };
  EXPECT_NO_THROW(ask(false, 4));
  EXPECT_EQ(testing::MessageOf<Error>([&] { ask(false, 0.5); }),
            "cam.json: a: rendering 10000x10000 pixels takes 3.2 GB of memory, more than `memory` "
            "0.5; give more, or a smaller `size`");
  EXPECT_EQ(testing::MessageOf<Error>([&] { ask(true, 4); }),
            "cam.json: a: a video of 10000x10000 pixels takes 24 GB of memory, more than `memory` "
            "4; give more, or a smaller `size`");
}

TEST_F(FrameMemory, ImagesOfAWindowTakeNothingFromTheViews) {
  EXPECT_EQ(BytesForViews({1280, 800, 1, 1, 0, 0}, 0.01), 1e7);
  EXPECT_LT(BytesForViews({8000, 4000, 1, 1, 0, 0}, 4), 3.1e9);
}

}  // namespace
}  // namespace dtr
