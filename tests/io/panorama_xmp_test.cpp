#include "dtr/io/panorama_xmp.h"

#include <gtest/gtest.h>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

constexpr char kAttributes[] =
    "<rdf:Description xmlns:GPano='http://ns.google.com/photos/1.0/panorama/' "
    "GPano:ProjectionType=\"equirectangular\" GPano:FullPanoWidthPixels = '8000' "
    "GPano:FullPanoHeightPixels=\"4000\" GPano:CroppedAreaLeftPixels=\"100\" "
    "GPano:CroppedAreaTopPixels=\"50\" GPano:CroppedAreaImageWidthPixels=\"7000\" "
    "GPano:CroppedAreaImageHeightPixels=\"3000\" GPano:PosePitchDegrees=\"-2.5\"/>";
constexpr char kElements[] =
    "<GPano:UsePanoramaViewer>True</GPano:UsePanoramaViewer>\n"
    "<GPano:ProjectionType>Equirectangular</GPano:ProjectionType>"
    "<GPano:FullPanoWidthPixels> 8000 </GPano:FullPanoWidthPixels>"
    "<GPano:FullPanoHeightPixels>4000</GPano:FullPanoHeightPixels>"
    "<GPano:CroppedAreaLeftPixels>100</GPano:CroppedAreaLeftPixels>"
    "<GPano:CroppedAreaTopPixels>50</GPano:CroppedAreaTopPixels>"
    "<GPano:CroppedAreaImageWidthPixels>7000</GPano:CroppedAreaImageWidthPixels>"
    "<GPano:CroppedAreaImageHeightPixels>3000</GPano:CroppedAreaImageHeightPixels>"
    "<GPano:PosePitchDegrees>-2.5</GPano:PosePitchDegrees>";

PanoramaXmp Expected() {
  PanoramaXmp xmp;
  xmp.projection = "equirectangular";
  xmp.full_width_px = 8000;
  xmp.full_height_px = 4000;
  xmp.cropped_width_px = 7000;
  xmp.cropped_height_px = 3000;
  xmp.left_px = 100;
  xmp.top_px = 50;
  xmp.pitch_deg = -2.5;
  return xmp;
}

TEST(PanoramaXmp, AttributesAndElementsMeanTheSame) {
  EXPECT_EQ(PanoramaXmpIn(kAttributes), Expected());
  EXPECT_EQ(PanoramaXmpIn(kElements), Expected());
}

TEST(PanoramaXmp, WhatStatesNoProjectionIsNone) {
  EXPECT_FALSE(PanoramaXmpIn(""));
  EXPECT_FALSE(PanoramaXmpIn("GPano:FullPanoWidthPixels=\"8000\""));
  EXPECT_FALSE(PanoramaXmpIn("GPano:ProjectionTypes=\"equirectangular\""));
  EXPECT_FALSE(PanoramaXmpIn("</GPano:ProjectionType>"));
}

TEST(PanoramaXmp, NumbersThatAreNoneAreLeftOut) {
  const auto width = [](const std::string& value) {
    return PanoramaXmpIn("GPano:ProjectionType=\"equirectangular\" GPano:FullPanoWidthPixels=\"" +
                         value + "\"")
        ->full_width_px;
  };
  EXPECT_EQ(width("4096"), 4096);
  for (const char* value : {"nan", "inf", "-5", "1e9", "12px", "", "1e999"}) {
    EXPECT_EQ(width(value), 0) << value;
  }
}

TEST(PanoramaXmp, EveryTruncationGivesLessAndNothingElse) {
  const std::string whole = kAttributes;
  for (size_t length = 0; length < whole.size(); ++length) {
    const auto part = PanoramaXmpIn(std::string_view(whole).substr(0, length));
    if (!part) continue;
    EXPECT_EQ(part->projection, "equirectangular");
    EXPECT_TRUE(part->full_width_px == 0 || part->full_width_px == 8000);
  }
}

TEST(PanoramaXmp, AJpegSaysWhatItIsAndKeepsItsPixels) {
  const testing::TemporaryFolder folder;
  ImageRgb8 image(64, 32, 3);
  for (size_t i = 0; i < image.data().size(); ++i) {
    image.data()[i] = static_cast<std::uint8_t>(i % 64);
  }
  WritePanoramaJpeg(folder / "sphere.jpg", image, 95);
  WriteImage(folder / "plain.jpg", image, 95);
  const auto header = ReadImageHeader(folder / "sphere.jpg");
  ASSERT_TRUE(header.panorama);
  EXPECT_EQ(header.panorama->projection, "equirectangular");
  EXPECT_EQ(header.panorama->full_width_px, 64);
  EXPECT_EQ(header.panorama->cropped_height_px, 32);
  EXPECT_FALSE(ReadImageHeader(folder / "plain.jpg").panorama);
  EXPECT_EQ(ReadImage(folder / "sphere.jpg"), ReadImage(folder / "plain.jpg"));
}

TEST(PanoramaXmp, APacketBehindTheImageIsFound) {
  const testing::TemporaryFolder folder;
  // As WebP and some stitchers have it, behind more than is searched at the beginning.
  WriteFileAtomically(folder / "late", std::string(3 << 20, ' ') + kAttributes);
  EXPECT_EQ(ReadPanoramaXmp(folder / "late"), Expected());
  EXPECT_FALSE(ReadPanoramaXmp(folder / "absent"));
}

}  // namespace
}  // namespace dtr::io
