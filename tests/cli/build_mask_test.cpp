// What a mask hides from `dtr build` has no depth in the set, and draws nothing.
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kLeft = 40, kRight = 100, kTop = 20, kBottom = 60;

/// Share of the rectangle, drawn in by `rim`, that has depth.
double DepthShare(const DepthImage& depth, int rim) {
  double with = 0, all = 0;
  for (int y = kTop + rim; y < kBottom - rim; ++y) {
    for (int x = kLeft + rim; x < kRight - rim; ++x) {
      ++all;
      with += !DepthImage::IsHole(depth(x, y));
    }
  }
  return with / all;
}

TEST(BuildWithMasks, WhatAMaskHidesHasNoDepth) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "c");
  const auto build = [&](const std::string& name) {
    const fs::path set = folder / name;
    DtrOk({"build", (folder / "c/images").string(), "-o", set.string(), "--poses",
           (folder / "c/sparse").string(), "--max-size", "0", "--passes", "0", "--iterations", "2",
           "--neighbours", "2"});
    DtrSet read = io::ReadSet(set);
    for (View& view : read.frames.front().views) io::LoadPixels(set, view, {});
    return read;
  };
  const DtrSet whole = build("whole.dtr");
  Mask mask(kCourtyardWidthPx, kCourtyardHeightPx, 1, 255);
  for (int y = kTop; y < kBottom; ++y) {
    for (int x = kLeft; x < kRight; ++x) mask(x, y) = 0;
  }
  io::WriteMask(folder / "c/images/0003_mask.png", mask);
  const DtrSet masked = build("masked.dtr");

  const std::vector<View>&before = whole.frames.front().views, &after = masked.frames.front().views;
  ASSERT_EQ(before.size(), static_cast<size_t>(kCourtyardViews));
  ASSERT_EQ(before[3].depth.width(), kCourtyardWidthPx);
  EXPECT_GT(DepthShare(before[3].depth, 0), 0.5) << "else nothing would be tested";
  EXPECT_EQ(DepthShare(after[3].depth, 0), 0);
  // The others go on where they were: it is the photo that is masked, not the scene.
  double left = 0, right = 0;
  for (size_t i = 0; i < before.size(); ++i) {
    if (i == 3) continue;
    left += DepthShare(before[i].depth, 0);
    right += DepthShare(after[i].depth, 0);
  }
  EXPECT_GT(right, 0.8 * left);

  const fs::path seen = folder / "seen.png";
  DtrOk({"render", (folder / "masked.dtr").string(), "--renderer", "cpu", "--like", "0003",
         "--views", "1", "-o", (folder / "v.png").string(), "--coverage-out", seen.string()});
  const Mask coverage = io::ReadMask(seen);
  int drawn = 0;
  for (int y = kTop; y < kBottom; ++y) {
    for (int x = kLeft; x < kRight; ++x) drawn += coverage(x, y) != 0;
  }
  EXPECT_EQ(drawn, 0);
}

}  // namespace
}  // namespace dtr::testing
