// Raw files of cameras, developed alike.
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/io/image_io.h"
#include "tests/support/dng_file.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using dtr::testing::DngSpec;
using dtr::testing::TemporaryFolder;
using dtr::testing::WriteDng;

double Linear(double level) {
  const double v = level / 255;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

std::array<double, 3> MeanOf(const ImageRgb8& image) {
  std::array<double, 3> mean{};
  for (size_t i = 0; i < image.data().size(); ++i) mean[i % 3] += image.data()[i];
  for (double& value : mean) value /= static_cast<double>(image.data().size() / 3);
  return mean;
}

// A grey surface under light that the sensor sees as `neutral`.
DngSpec GreyUnder(std::array<double, 3> neutral, double value) {
  DngSpec spec;
  spec.neutral = neutral;
  spec.value = [=](int x, int y) {
    const size_t channel = static_cast<size_t>(x % 2 + y % 2);  // red, green, green, blue
    return static_cast<int>(std::lround(value * neutral[channel]));
  };
  return spec;
}

TEST(RawPhoto, SizeTurnAndFocalLengthAreThoseOfTheFile) {
  const TemporaryFolder folder;
  DngSpec spec;
  WriteDng(folder / "a.dng", spec);
  const ImageHeader header = ReadImageHeader(folder / "a.dng");
  EXPECT_EQ(header.format, "raw");
  EXPECT_EQ(header.width_px, 128);
  EXPECT_EQ(header.height_px, 96);
  ASSERT_TRUE(header.focal_mm && header.focal_35mm && header.raw_balance);
  EXPECT_NEAR(*header.focal_mm, 4.25, 1e-6);
  EXPECT_EQ(*header.focal_35mm, 26);
  EXPECT_NEAR((*header.raw_balance)[0], 1 / 0.5, 1e-3);
  EXPECT_EQ((*header.raw_balance)[1], 1);
  EXPECT_NEAR((*header.raw_balance)[2], 1 / 0.7, 1e-3);

  // The sensor's top is bright; turned by EXIF 6 the right side is, once.
  spec.orientation = 6;
  spec.value = [](int, int y) { return y < 48 ? 30000 : 3000; };
  WriteDng(folder / "b.dng", spec);
  const ImageHeader turned = ReadImageHeader(folder / "b.dng");
  const ImageRgb8 image = ReadImage(folder / "b.dng", {.apply_exif_orientation = true});
  EXPECT_EQ(image.width(), 96);
  EXPECT_EQ(image.height(), 128);
  const bool sideways = turned.exif_orientation >= 5;
  EXPECT_EQ(sideways ? turned.height_px : turned.width_px, 96);
  EXPECT_GT(image(80, 64, 1), 2 * image(16, 64, 1));
}

TEST(RawPhoto, BrightnessIsThatOfTheExposure) {
  constexpr double kShare = 0.02;  // rounding to 8 bits of a level near 100
  const TemporaryFolder folder;
  WriteDng(folder / "dark.dng", GreyUnder({0.5, 1, 0.7}, 6000));
  WriteDng(folder / "bright.dng", GreyUnder({0.5, 1, 0.7}, 12000));
  const auto dark = MeanOf(ReadImage(folder / "dark.dng"));
  const auto bright = MeanOf(ReadImage(folder / "bright.dng"));
  // Automatic brightness would make both alike.
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(Linear(bright[c]) / Linear(dark[c]), 2, 2 * kShare) << c;
    EXPECT_NEAR(dark[c], dark[1], 3) << c;  // grey under the camera's own white balance
  }
}

TEST(RawPhoto, OneWhiteBalanceMakesOneSensorValueOneColour) {
  const TemporaryFolder folder;
  DngSpec a = GreyUnder({0.5, 1, 0.7}, 9000), b = a;
  b.neutral = {0.7, 1, 0.5};  // the camera took the same light for another
  WriteDng(folder / "a.dng", a);
  WriteDng(folder / "b.dng", b);
  EXPECT_GT(
      std::abs(MeanOf(ReadImage(folder / "a.dng"))[0] - MeanOf(ReadImage(folder / "b.dng"))[0]),
      10);
  const RawBalance balance = *ReadImageHeader(folder / "a.dng").raw_balance;
  EXPECT_EQ(ReadImage(folder / "a.dng", {.raw_balance = balance}),
            ReadImage(folder / "b.dng", {.raw_balance = balance}));
  EXPECT_EQ(ReadImage(folder / "a.dng", {.raw_balance = balance}), ReadImage(folder / "a.dng"));
}

}  // namespace
}  // namespace dtr::io
