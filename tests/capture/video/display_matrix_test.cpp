#include "capture/video/display_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "dtr/io/image_io.h"

namespace dtr::capture {
namespace {

constexpr std::int32_t kOne = 1 << 16;

// Entries a, b, c, d.
using Axes = std::array<std::int32_t, 4>;

DisplayMatrix MatrixOf(const Axes& axes) {
  return {axes[0] * kOne, axes[1] * kOne, 0, axes[2] * kOne, axes[3] * kOne, 0, 0, 0, 1 << 30};
}

// Pixels where ISO 14496-12 puts them: (a p + c q, b p + d q), moved to begin at 0.
ImageRgb8 Shown(const ImageRgb8& stored, const Axes& axes) {
  const bool exchanged = axes[0] == 0;
  const int width = exchanged ? stored.height() : stored.width();
  const int height = exchanged ? stored.width() : stored.height();
  ImageRgb8 shown(width, height, 3);
  for (int q = 0; q < stored.height(); ++q) {
    for (int p = 0; p < stored.width(); ++p) {
      int x = axes[0] * p + axes[2] * q, y = axes[1] * p + axes[3] * q;
      if (axes[0] < 0 || axes[2] < 0) x += width - 1;
      if (axes[1] < 0 || axes[3] < 0) y += height - 1;
      for (int c = 0; c < 3; ++c) shown(x, y, c) = stored(p, q, c);
    }
  }
  return shown;
}

TEST(DisplayMatrix, AllRotationsAndMirroringsPutPixelsWhereTheStandardSays) {
  ImageRgb8 stored(5, 3, 3);
  for (size_t i = 0; i < stored.data().size(); ++i) {
    stored.data()[i] = static_cast<std::uint8_t>(5 * i);
  }
  std::array<bool, 9> seen{};
  for (const Axes axes :
       {Axes{1, 0, 0, 1}, Axes{-1, 0, 0, 1}, Axes{-1, 0, 0, -1}, Axes{1, 0, 0, -1},
        Axes{0, 1, 1, 0}, Axes{0, 1, -1, 0}, Axes{0, -1, -1, 0}, Axes{0, -1, 1, 0}}) {
    const auto orientation = ExifOrientationOf(MatrixOf(axes));
    ASSERT_TRUE(orientation);
    EXPECT_EQ(io::ApplyExifOrientation(stored, *orientation), Shown(stored, axes)) << *orientation;
    seen.at(static_cast<size_t>(*orientation)) = true;
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 8);
}

TEST(DisplayMatrix, ScaleAndTheRestOfASineDoNotCount) {
  EXPECT_EQ(ExifOrientationOf({3, 2 * kOne, 0, -kOne, -4, 0, 1080 * kOne, 0, 1 << 30}), 6);
  EXPECT_EQ(ExifOrientationOf({kOne / 2, 0, 0, 0, 2 * kOne, 0, 0, 0, 1 << 30}), 1);
}

TEST(DisplayMatrix, OtherAnglesAndDegenerateMatricesAreNone) {
  EXPECT_FALSE(ExifOrientationOf({}));
  EXPECT_FALSE(ExifOrientationOf(MatrixOf({1, 0, 1, 0})));
  EXPECT_FALSE(ExifOrientationOf(MatrixOf({1, 1, -1, 1})));
  EXPECT_FALSE(ExifOrientationOf(MatrixOf({0, 1, 0, -1})));
  constexpr std::int32_t kLowest = INT32_MIN;
  EXPECT_EQ(ExifOrientationOf({kLowest, 0, 0, 0, kLowest, 0, 0, 0, 0}), 3);
}

}  // namespace
}  // namespace dtr::capture
