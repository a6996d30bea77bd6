#include "dtr/io/image_io.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/io/small_jpeg.h"
#include "tests/support/message_of.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

using OIIO::ImageSpec;
using OIIO::TypeDesc;
using testing::TemporaryFolder;
using testing::WriteForeign;

ImageRgb8 RandomImage(int width_px, int height_px, std::uint64_t seed) {
  Random random(seed);
  ImageRgb8 image(width_px, height_px, 3);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(random.Index(256));
  return image;
}

// A smooth image, which JPEG keeps within a few levels.
ImageRgb8 SmoothImage(int width_px, int height_px) {
  ImageRgb8 image(width_px, height_px, 3);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      image(x, y, 0) = static_cast<std::uint8_t>(40 + 3 * x);
      image(x, y, 1) = static_cast<std::uint8_t>(60 + 4 * y);
      image(x, y, 2) = static_cast<std::uint8_t>(200 - x - y);
    }
  }
  return image;
}

TEST(WriteImage, PngRoundTripsExactlyAndTheSameBytesTwice) {
  const TemporaryFolder folder;
  const ImageRgb8 image = RandomImage(13, 7, 1);
  for (const char* name : {"a.png", "a.JPG"}) {
    WriteImage(folder / name, image);
    const std::string first = ReadFile(folder / name, 1 << 20);
    WriteImage(folder / name, image);
    EXPECT_EQ(ReadFile(folder / name, 1 << 20), first);
  }
  EXPECT_EQ(ReadImage(folder / "a.png"), image);
  EXPECT_THROW(WriteImage(folder / "a.tga", image), UsageError);
  EXPECT_THROW(WriteImage(folder / "no/such/folder.png", image), Error);
}

TEST(WriteImage, JpegKeepsASmoothImage) {
  constexpr int kJpegLevels = 3;  // quality 95, no chroma subsampling; worst seen was 2
  const TemporaryFolder folder;
  const ImageRgb8 image = SmoothImage(40, 30);
  WriteImage(folder / "a.jpg", image);
  const ImageRgb8 back = ReadImage(folder / "a.jpg");
  ASSERT_EQ(back.data().size(), image.data().size());
  for (size_t i = 0; i < image.data().size(); ++i) {
    ASSERT_LE(std::abs(back.data()[i] - image.data()[i]), kJpegLevels);
  }
}

TEST(ReadImage, EveryTruncatedPrefixIsAnError) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.jpg"}) {
    WriteImage(folder / name, RandomImage(9, 8, 2));
    testing::ExpectEveryPrefixIsAnError(folder / name, 3, [&] { ReadImage(folder / name); });
  }
}

TEST(ReadImage, GreyBecomesRgbAndAlphaIsNotMultipliedIn) {
  const TemporaryFolder folder;
  WriteMask(folder / "grey.png", Mask(3, 2, 1, 77));
  EXPECT_EQ(ReadImage(folder / "grey.png"), ImageRgb8(3, 2, 3, 77));
  const ImageRgb8 image = RandomImage(5, 4, 3);
  Mask alpha(5, 4, 1, 255);
  alpha(2, 2) = 0;
  WriteImageWithAlpha(folder / "alpha.png", image, alpha);
  EXPECT_EQ(ReadImageHeader(folder / "alpha.png").channels, 4);
  ImageRgb8 read = ReadImage(folder / "alpha.png");
  for (int c = 0; c < 3; ++c) read(2, 2, c) = image(2, 2, c);  // hidden: see alpha_test
  EXPECT_EQ(read, image);
  EXPECT_THROW(WriteImageWithAlpha(folder / "alpha.png", image, Mask(4, 4)), Error);
  EXPECT_THROW(WriteImageWithAlpha(folder / "alpha.jpg", image, alpha), UsageError);
}

TEST(ReadImage, SixteenBitsAreRoundedAndFloatsAreLinearLight) {
  const TemporaryFolder folder;
  WriteForeign<std::uint16_t>(folder / "deep.png", ImageSpec(2, 1, 3, TypeDesc::UINT16),
                              {0, 128, 129, 65535, 32896, 65406});  // 257 per level
  EXPECT_EQ(ReadImage(folder / "deep.png").data(),
            (std::vector<std::uint8_t>{0, 0, 1, 255, 128, 254}));
  // IEC 61966-2-1: 0.2158605 linear is 0.5019608 = 128/255; above 1 and below 0 is clipped.
  WriteForeign<float>(folder / "linear.exr", ImageSpec(1, 1, 3, TypeDesc::FLOAT),
                      {0.2158605f, 7.0f, -1.0f});
  EXPECT_EQ(ReadImage(folder / "linear.exr").data(), (std::vector<std::uint8_t>{128, 255, 0}));
}

TEST(ReadImage, RejectsNaNAndInfinity) {
  const TemporaryFolder folder;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), HUGE_VALF}) {
    WriteForeign<float>(folder / "bad.exr", ImageSpec(1, 1, 3, TypeDesc::FLOAT), {0, bad, 0});
    EXPECT_THROW(ReadImage(folder / "bad.exr"), Error);
  }
}

TEST(ReadImage, RejectsTextFoldersAbsentFilesAndTooManyPixels) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "text.jpg", "this is no photo");
  EXPECT_THROW(ReadImage(folder / "text.jpg"), Error);
  EXPECT_THROW(ReadImageHeader(folder / "text.jpg"), Error);
  EXPECT_THROW(ReadImage(folder / "absent.jpg"), Error);
  EXPECT_THROW(ReadImage(folder.path()), Error);
  WriteImage(folder / "a.png", ImageRgb8(10, 10, 3));
  EXPECT_NO_THROW(ReadImage(folder / "a.png", {.limit_px = 100}));
  EXPECT_THROW(ReadImage(folder / "a.png", {.limit_px = 99}), Error);
}

std::string RejectionOf(const std::filesystem::path& file) {
  try {
    ReadImage(file);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// OpenEXR would allocate what the header claims, up to 2 GiB, before it reads.
TEST(ReadImage, AnExrThatClaimsMoreThanItHoldsIsRejectedBeforeAllocation) {
  const TemporaryFolder folder;
  const auto file = folder / "a.exr";
  WriteForeign<float>(file, ImageSpec(1, 1, 3, TypeDesc::FLOAT), {0.5f, 0.25f, 0.125f});
  const std::string good = ReadFile(file, 1 << 20);
  EXPECT_NO_THROW(ReadImage(file));
  const size_t length_at = good.find("chlist") + std::string("chlist").size() + 1;
  for (const char* claim : {"\x7f\0\0\x6f", "\0\0\0\0", "\xff\xff\xff\xff"}) {
    std::string bad = good;
    bad.replace(length_at, 4, claim, 4);
    WriteFileAtomically(file, bad);
    EXPECT_THAT(RejectionOf(file), ::testing::HasSubstr("damaged EXR"));
  }
  std::string channels = good;  // the list of channels runs on past its own length
  channels[good.find("compression") - 1] = 'x';
  WriteFileAtomically(file, channels);
  EXPECT_THAT(RejectionOf(file), ::testing::HasSubstr("damaged EXR"));
}

// OpenEXR allocates a chunk's pixels and the table of all chunks by the header alone.
TEST(ReadImage, AnExrOfMoreOrLargerChunksThanItsFileHoldsIsRejected) {
  const TemporaryFolder folder;
  const auto file = folder / "a.exr";
  WriteForeign<float>(file, ImageSpec(4, 4, 1, TypeDesc::FLOAT), std::vector<float>(16, 0.5f));
  const std::string good = ReadFile(file, 1 << 20);
  EXPECT_NO_THROW(ReadImage(file));
  const std::string name = std::string("dataWindow") + '\0' + "box2i" + '\0';
  const size_t window_at = good.find(name) + name.size() + 4;
  const auto with_window = [&](std::int32_t right, std::int32_t bottom) {
    std::string bad = good;
    std::memcpy(bad.data() + window_at + 8, &right, 4);
    std::memcpy(bad.data() + window_at + 12, &bottom, 4);
    return bad;
  };
  const auto without_compression = [](std::string bytes) {
    bytes[bytes.find("compression")] = 'C';  // an attribute that nobody knows
    return bytes;
  };
  const std::vector<std::pair<std::string, const char*>> cases{
      {with_window(3, 2000000000), "a table of chunks that fits"},
      {with_window(2000000000, 3), "chunks that can be packed"},
      {with_window(100000, 3), "chunks that can be packed"},  // 6.4 MB, for which 130 are allocated
      {without_compression(with_window(100000, 3)), "in chunks of 16 lines"},  // OpenEXR's default
      {with_window(-7, 3), "at least one pixel"},
      {with_window(3, -1), "at least one pixel"}};
  for (const auto& [bad, complaint] : cases) {
    WriteFileAtomically(file, bad);
    EXPECT_THAT(RejectionOf(file), ::testing::HasSubstr(complaint));
  }
}

// Without this OpenImageIO offers the file to every decoder it has.
TEST(ReadImage, AFileThatBeginsLikeNoImageIsRejectedWithItsBeginning) {
  const TemporaryFolder folder;
  WriteImage(folder / "a.png", SmoothImage(8, 6));
  std::string bytes = ReadFile(folder / "a.png", 1 << 20);
  EXPECT_NO_THROW(ReadImage(folder / "a.png"));
  bytes[1] = 'Q';
  WriteFileAtomically(folder / "a.png", bytes);
  EXPECT_THAT(RejectionOf(folder / "a.png"), ::testing::HasSubstr("begins with \".QNG"));
  WriteFileAtomically(folder / "notes.jpg", "These are no pixels.");
  EXPECT_THAT(RejectionOf(folder / "notes.jpg"),
              ::testing::HasSubstr("no readable image: expected a PNG, JPEG"));
  WriteFileAtomically(folder / "empty.jpg", "");
  EXPECT_THAT(RejectionOf(folder / "empty.jpg"), ::testing::HasSubstr("begins with \"\""));
}

TEST(ReadImage, ASizeThatTheFileCannotHoldIsRejectedBeforeAllocation) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "a.ppm", "P6\n19999 19999\n255\n" + std::string(300, 'x'));
  EXPECT_THAT(RejectionOf(folder / "a.ppm"),
              ::testing::HasSubstr("expected as many pixels as 319 bytes can hold, found 19999x"));
  // White masks of photos are small files, and real.
  WriteMask(folder / "m.png", Mask(3000, 2000, 1, 255));
  EXPECT_EQ(ReadMask(folder / "m.png").width(), 3000);
}

// 16x16 pixels of one colour.
void WriteInksOf(const std::filesystem::path& file, std::array<JSAMPLE, 4> inks, bool marker) {
  std::vector<JSAMPLE> values;
  for (int i = 0; i < 16 * 16; ++i) values.insert(values.end(), inks.begin(), inks.end());
  testing::WriteInks(file, 16, 16, values, marker);
}

TEST(ReadImage, InksOfAJpegAreInvertedWhereAdobesMarkerSaysSo) {
  const TemporaryFolder folder;
  // C 20, M 100, Y 200, K 51: (255 - C) (255 - 51) / 255 = 188, 124, 44.
  const std::vector<std::uint8_t> expected{188, 124, 44};
  WriteInksOf(folder / "plain.jpg", {20, 100, 200, 51}, false);
  WriteInksOf(folder / "adobe.jpg", {235, 155, 55, 204}, true);
  for (const char* name : {"plain.jpg", "adobe.jpg"}) {
    const ImageRgb8 image = ReadImage(folder / name);
    ASSERT_EQ(image.width(), 16) << name;
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(image(7, 7, c), expected[static_cast<size_t>(c)], 1) << name;
  }
  testing::ExpectEveryPrefixIsAnError(folder / "plain.jpg", 40,
                                      [&] { ReadImage(folder / "plain.jpg"); });
}

TEST(ReadImage, ProgressiveJpegIsReadAsWell) {
  const TemporaryFolder folder;
  const ImageRgb8 image = SmoothImage(32, 24);
  ImageSpec spec(32, 24, 3, TypeDesc::UINT8);
  spec.attribute("CompressionQuality", 95);
  spec.attribute("jpeg:progressive", 1);
  WriteForeign<std::uint8_t>(folder / "a.jpg", spec, {image.data().begin(), image.data().end()});
  // SOF2 says that it is progressive (ITU T.81, table B.1).
  ASSERT_NE(ReadFile(folder / "a.jpg", 1 << 20).find("\xff\xc2"), std::string::npos);
  const ImageRgb8 read = ReadImage(folder / "a.jpg");
  for (size_t i = 0; i < image.data().size(); ++i) {
    ASSERT_NEAR(read.data()[i], image.data()[i], 12) << i;
  }
}

// Photos that lost a part of their data: decoders go on with what follows, as other blocks in other
// colours, and end before or behind the data's end.
TEST(ReadImage, AJpegWithAHoleOrWithoutItsSecondHalfIsNoPhoto) {
  const TemporaryFolder folder;
  WriteImage(folder / "a.jpg", RandomImage(96, 64, 3), 90);
  const std::string whole = ReadFile(folder / "a.jpg", 1 << 20);
  const size_t size = whole.size();
  const auto reason = [&](const std::string& bytes) {
    WriteFileAtomically(folder / "b.jpg", bytes);
    return testing::MessageOf<Error>([&] { ReadImage(folder / "b.jpg"); });
  };
  for (const size_t hole : {512, 1024, 2048}) {
    std::string zeros = whole, lost = whole;
    zeros.replace(size / 2, hole, hole, '\0');
    lost.erase(size / 2, hole);
    EXPECT_THAT(reason(zeros),
                ::testing::HasSubstr("b.jpg: damaged image: expected a whole JPEG, found: "));
    EXPECT_THAT(reason(lost), ::testing::HasSubstr(" data that end at row "));
  }
  std::string never_written = whole;
  never_written.replace(size / 2, size - size / 2, size - size / 2, '\0');
  EXPECT_THAT(reason(never_written), ::testing::HasSubstr("; copy the file again"));
}

// Webcams leave a few bytes behind the last row, some cameras fill up to a multiple of a block.
TEST(ReadImage, WhatCamerasLeaveBehindTheLastRowOfAJpegDoesNoHarm) {
  const TemporaryFolder folder;
  WriteImage(folder / "a.jpg", SmoothImage(48, 32));
  const ImageRgb8 image = ReadImage(folder / "a.jpg");
  const std::string whole = ReadFile(folder / "a.jpg", 1 << 20);
  for (const std::string& filling :
       {std::string("\x12\x34"), std::string(3000, '\0'), std::string(70, '\x20')}) {
    std::string bytes = whole;
    bytes.insert(whole.size() - 2, filling);
    WriteFileAtomically(folder / "b.jpg", bytes);
    EXPECT_EQ(ReadImage(folder / "b.jpg"), image) << filling.size();
  }
  WriteFileAtomically(folder / "b.jpg", whole + "ftyp: a film behind the photo");
  EXPECT_EQ(ReadImage(folder / "b.jpg"), image);
}

TEST(ReadImage, TurnsThePhotoUprightOnRequest) {
  const TemporaryFolder folder;
  // EXIF 6: the stored left edge is the top after a quarter turn clockwise.
  ImageSpec spec(2, 1, 3, TypeDesc::UINT8);
  spec.attribute("Orientation", 6);
  WriteForeign<std::uint8_t>(folder / "six.tif", spec, {1, 1, 1, 2, 2, 2});
  EXPECT_EQ(ReadImageHeader(folder / "six.tif").exif_orientation, 6);
  EXPECT_EQ(ReadImage(folder / "six.tif").width(), 2);
  const ImageRgb8 upright = ReadImage(folder / "six.tif", {.apply_exif_orientation = true});
  ASSERT_EQ(upright.height(), 2);
  EXPECT_EQ(upright(0, 0), 1);
  EXPECT_EQ(upright(0, 1), 2);
}

TEST(ApplyExifOrientation, FollowsTheCornersOfTheExifTable) {
  // Stored 3x2:  1 2 3      where the stored corners 1, 3, 4 and 6 land, in the order
  //              4 5 6      top left, top right, bottom left, bottom right (EXIF 2.3, 0x0112).
  ImageRgb8 image(3, 2, 3);
  for (int i = 0; i < 6; ++i) image(i % 3, i / 3, 0) = static_cast<std::uint8_t>(i + 1);
  const int corners[9][4] = {{},           {1, 3, 4, 6}, {3, 1, 6, 4}, {6, 4, 3, 1}, {4, 6, 1, 3},
                             {1, 4, 3, 6}, {4, 1, 6, 3}, {6, 3, 4, 1}, {3, 6, 1, 4}};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const ImageRgb8 up = ApplyExifOrientation(image, orientation);
    const int right = up.width() - 1, bottom = up.height() - 1;
    EXPECT_EQ(up(0, 0), corners[orientation][0]) << orientation;
    EXPECT_EQ(up(right, 0), corners[orientation][1]) << orientation;
    EXPECT_EQ(up(0, bottom), corners[orientation][2]) << orientation;
    EXPECT_EQ(up(right, bottom), corners[orientation][3]) << orientation;
  }
}

TEST(ReadImageHeader, NamesTheLens) {
  const TemporaryFolder folder;
  OIIO::ImageSpec spec(2, 2, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Exif:LensModel", "Lens 1");
  WriteForeign<std::uint8_t>(folder / "lens.jpg", spec, std::vector<std::uint8_t>(12, 100));
  EXPECT_EQ(ReadImageHeader(folder / "lens.jpg").lens_model, "Lens 1");
}

TEST(WriteJpegWithExif, HeaderReadsTheLensBack) {
  const TemporaryFolder folder;
  WriteJpegWithExif(folder / "a.jpg", SmoothImage(32, 20), 95, {4.25, 26.0, "Acme", "Model 1"});
  const ImageHeader header = ReadImageHeader(folder / "a.jpg");
  EXPECT_EQ(header.width_px, 32);
  EXPECT_EQ(header.height_px, 20);
  EXPECT_EQ(header.bits, 8);
  EXPECT_EQ(header.format, "jpeg");
  EXPECT_FALSE(header.is_float);
  EXPECT_NEAR(header.focal_mm.value_or(0), 4.25, 1e-4);  // EXIF stores a rational
  EXPECT_EQ(header.focal_35mm, 26);
  EXPECT_EQ(header.make, "Acme");
  EXPECT_EQ(header.model, "Model 1");
  EXPECT_FALSE(header.gps);
  const std::string first = ReadFile(folder / "a.jpg", 1 << 20);
  WriteJpegWithExif(folder / "a.jpg", SmoothImage(32, 20), 95, {4.25, 26.0, "Acme", "Model 1"});
  EXPECT_EQ(ReadFile(folder / "a.jpg", 1 << 20), first);
}

TEST(ReadImageHeader, LeavesOutWhatMakesNoSense) {
  const TemporaryFolder folder;
  ImageSpec spec(2, 2, 3, TypeDesc::UINT8);
  spec.attribute("Exif:FocalLength", 0.0f);
  spec.attribute("Exif:FocalLengthIn35mmFilm", 0);
  spec.attribute("Make", "Zero");
  WriteForeign<std::uint8_t>(folder / "zero.jpg", spec, std::vector<std::uint8_t>(12));
  const ImageHeader header = ReadImageHeader(folder / "zero.jpg");
  EXPECT_EQ(header.make, "Zero");
  EXPECT_FALSE(header.focal_mm);
  EXPECT_FALSE(header.focal_35mm);
}

TEST(ReadImageHeader, ReadsTheGpsPositionSouthAndWestNegative) {
  const TemporaryFolder folder;
  ImageSpec spec(2, 2, 3, TypeDesc::UINT8);
  const float latitude[3] = {33, 30, 36}, longitude[3] = {70, 15, 0};
  spec.attribute("GPS:LatitudeRef", "S");
  spec.attribute("GPS:Latitude", TypeDesc(TypeDesc::FLOAT, 3), latitude);
  spec.attribute("GPS:LongitudeRef", "W");
  spec.attribute("GPS:Longitude", TypeDesc(TypeDesc::FLOAT, 3), longitude);
  spec.attribute("GPS:Altitude", 512.5f);
  spec.attribute("GPS:HPositioningError", 4.5f);
  WriteForeign<std::uint8_t>(folder / "gps.jpg", spec, std::vector<std::uint8_t>(12));
  const auto gps = ReadImageHeader(folder / "gps.jpg").gps;
  ASSERT_TRUE(gps);
  EXPECT_NEAR(gps->latitude_deg, -33.51, 1e-6);
  EXPECT_NEAR(gps->longitude_deg, -70.25, 1e-6);
  EXPECT_NEAR(gps->altitude_m.value_or(0), 512.5, 1e-3);
  EXPECT_NEAR(gps->horizontal_error_m.value_or(0), 4.5, 1e-3);
}

TEST(SmallJpeg, HasLessErrorInAsManyBytes) {
  const TemporaryFolder folder;
  Random random(7);
  ImageRgb8 image(128, 96, 3);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 128; ++x) {
      const double texture = 4 * random.Uniform(-1, 1);
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = static_cast<std::uint8_t>(128 + 60 * std::sin(0.2 * x + c) + texture);
      }
    }
  }
  const auto squared_error = [&](const std::string& name) {
    const ImageRgb8 read = ReadImage(folder / name);
    double sum = 0;
    for (size_t i = 0; i < read.data().size(); ++i) {
      sum += std::pow(double(read.data()[i]) - image.data()[i], 2);
    }
    return sum;
  };
  const std::string small = SmallJpeg(image, 85);
  WriteFileAtomically(folder / "small.jpg", small);
  // The usual one of at least this size.
  for (int quality = 50; quality <= 100; ++quality) {
    WriteImage(folder / "usual.jpg", image, quality);
    if (std::filesystem::file_size(folder / "usual.jpg") >= small.size()) break;
  }
  EXPECT_LT(squared_error("small.jpg"), squared_error("usual.jpg"));
}

TEST(SmallJpeg, SaysWhatJpegCannotHold) {
  try {
    SmallJpeg(ImageRgb8(65501, 1, 3), 85);
    FAIL() << "a JPEG of more than 65500 pixels a side";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::StartsWith("cannot code a JPEG: "));
  }
}

TEST(ReadMask, HalfScaleAndMoreIsUsable) {
  const TemporaryFolder folder;
  Mask grey(3, 1);
  grey(0, 0) = 127;
  grey(1, 0) = 128;
  grey(2, 0) = 250;
  WriteMask(folder / "m.png", grey);
  EXPECT_EQ(ReadMask(folder / "m.png").data(), (std::vector<std::uint8_t>{0, 255, 255}));
}

TEST(ReadImageHeader, RealPhotosOfSceaux) {
  const auto photo = testing::DataFolder() / "sceaux_castle/images/100_7100.JPG";
  DTR_REQUIRE_DATA(photo);
  const ImageHeader header = ReadImageHeader(photo);
  EXPECT_EQ(header.width_px, 2832);
  EXPECT_EQ(header.height_px, 2128);
  EXPECT_TRUE(header.focal_mm);
  EXPECT_FALSE(header.make.empty());
}

}  // namespace
}  // namespace dtr::io
