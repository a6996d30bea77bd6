// Photos in the colours, depths and orders of other programs: each has the colours it was made of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "dtr/base/error.h"
#include "dtr/base/process.h"
#include "dtr/io/colour_coding.h"
#include "dtr/io/image_io.h"
#include "tests/support/colour_files.h"
#include "tests/support/message_of.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using dtr::testing::BigEndian;
using dtr::testing::IccProfile;
using dtr::testing::InsertPngChunk;
using dtr::testing::MessageOf;
using dtr::testing::TemporaryFolder;
using dtr::testing::WriteForeign;
using dtr::testing::WriteTiff;
using OIIO::ImageSpec;
using OIIO::TypeDesc;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Colour = std::array<int, 3>;

constexpr int kW = 16, kH = 8;
constexpr Colour kRed{255, 0, 0}, kGreen{0, 255, 0};
// sRGB's red and green in other spaces, 8 bits (their matrices are published with the spaces).
constexpr Colour kRedInP3{234, 51, 35}, kGreenInP3{117, 251, 76}, kRedInAdobe{219, 0, 0};

ImageRgb8 Flat(const Colour& colour) {
  ImageRgb8 image(kW, kH, 3);
  for (size_t i = 0; i < image.data().size(); ++i) {
    image.data()[i] = static_cast<std::uint8_t>(colour[i % 3]);
  }
  return image;
}

void ExpectFlat(const fs::path& file, const Colour& colour, int levels) {
  const ImageRgb8 image = ReadImage(file);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(image(kW / 2, kH / 2, c), colour[static_cast<size_t>(c)], levels)
        << file << ", channel " << c;
  }
}

void WriteWithProfile(const fs::path& file, const Colour& colour, const std::string& icc,
                      TypeDesc type = TypeDesc::UINT8) {
  ImageSpec spec(kW, kH, 3, type);
  spec.attribute("ICCProfile", TypeDesc(TypeDesc::UINT8, static_cast<int>(icc.size())), icc.data());
  spec.attribute("CompressionQuality", 100);
  spec.attribute("jpeg:subsampling", "4:4:4");
  const ImageRgb8 image = Flat(colour);
  WriteForeign<std::uint8_t>(file, spec, {image.data().begin(), image.data().end()});
}

TEST(PhotoColours, IccProfilesAreApplied) {
  const TemporaryFolder folder;
  for (const char* extension : {".png", ".jpg", ".tif"}) {
    const fs::path file = folder / (std::string("photo") + extension);
    const std::string p3 = IccProfile(dtr::testing::kDisplayP3, 0);
    WriteWithProfile(file, kRedInP3, p3);
    ExpectFlat(file, kRed, 3);
    WriteWithProfile(file, kGreenInP3, p3);
    ExpectFlat(file, kGreen, 3);
    WriteWithProfile(file, kRedInAdobe, IccProfile(dtr::testing::kAdobeRgb, 563.0 / 256));
    ExpectFlat(file, kRed, 3);
    EXPECT_THAT(ReadImageHeader(file).remarks, IsEmpty());
  }
  WriteWithProfile(folder / "deep.png", kRedInP3, IccProfile(dtr::testing::kDisplayP3, 0),
                   TypeDesc::UINT16);
  ExpectFlat(folder / "deep.png", kRed, 3);
}

TEST(PhotoColours, ProfilesOfWebPAreApplied) {
  const TemporaryFolder folder;
  const fs::path file = folder / "photo.webp";
  ImageSpec spec(kW, kH, 3, TypeDesc::UINT8);
  spec.attribute("compression", "lossless");
  const ImageRgb8 image = Flat(kRedInP3);
  WriteForeign<std::uint8_t>(file, spec, {image.data().begin(), image.data().end()});
  ExpectFlat(file, kRedInP3, 1);  // its writer goes through YCbCr
  // The extended format (RFC 9649): VP8X with the flag of a profile, ICCP, then the image.
  const auto little = [](size_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 255);
    return text;
  };
  std::string icc = IccProfile(dtr::testing::kDisplayP3, 0);
  const std::string plain = ReadFile(file, 1 << 20);
  std::string chunks = "VP8X" + little(10, 4) + little(0x20, 4) + little(kW - 1, 3) +
                       little(kH - 1, 3) + "ICCP" + little(icc.size(), 4) + icc;
  if (icc.size() % 2 != 0) chunks += '\0';
  const size_t image_at = plain.find("VP8L");
  ASSERT_NE(image_at, std::string::npos);
  chunks += plain.substr(image_at);
  WriteFileAtomically(file, "RIFF" + little(chunks.size() + 4, 4) + "WEBP" + chunks);
  ExpectFlat(file, kRed, 3);
}

TEST(PhotoColours, AProfileOfSrgbChangesNoByteAndABrokenOneIsRemarked) {
  const TemporaryFolder folder;
  WriteWithProfile(folder / "srgb.png", {200, 100, 50}, IccProfile(dtr::testing::kSrgb, 0));
  ExpectFlat(folder / "srgb.png", {200, 100, 50}, 0);
  const std::string icc = IccProfile(dtr::testing::kDisplayP3, 0);
  WriteWithProfile(folder / "broken.tif", {200, 100, 50}, icc.substr(0, icc.size() / 4));
  ExpectFlat(folder / "broken.tif", {200, 100, 50}, 0);
  EXPECT_THAT(ReadImageHeader(folder / "broken.tif").remarks,
              Contains(HasSubstr("its colour profile cannot be read")));
}

TEST(PhotoColours, AdobeRgbOfCamerasWithoutProfileIsConverted) {
  const TemporaryFolder folder;
  ImageSpec spec(kW, kH, 3, TypeDesc::UINT8);
  spec.attribute("Exif:ColorSpace", 2);
  spec.attribute("CompressionQuality", 100);
  spec.attribute("jpeg:subsampling", "4:4:4");
  const ImageRgb8 image = Flat(kRedInAdobe);
  WriteForeign<std::uint8_t>(folder / "adobe.jpg", spec,
                             {image.data().begin(), image.data().end()});
  ExpectFlat(folder / "adobe.jpg", kRed, 3);
}

std::string Chromaticities(const std::array<double, 6>& xy) {
  std::string content = BigEndian(31270) + BigEndian(32900);
  for (const double value : xy) content += BigEndian(static_cast<std::uint32_t>(value * 1e5 + 0.5));
  return content;
}

TEST(PhotoColours, GammaAndPrimariesOfPngAreApplied) {
  const TemporaryFolder folder;
  const fs::path file = folder / "photo.png";
  // Light of one half in 16 bits is 188 in sRGB.
  ImageSpec spec(kW, kH, 3, TypeDesc::UINT16);
  WriteForeign(file, spec, std::vector<std::uint16_t>(3 * kW * kH, 32768));
  ExpectFlat(file, {128, 128, 128}, 0);
  InsertPngChunk(file, "gAMA", BigEndian(100000));
  ExpectFlat(file, {188, 188, 188}, 0);
  // Gamma 1.8: 0.5 to the power of 1.8 is 0.2872, 146 in sRGB.
  WriteForeign(file, spec, std::vector<std::uint16_t>(3 * kW * kH, 32768));
  InsertPngChunk(file, "gAMA", BigEndian(55556));
  ExpectFlat(file, {146, 146, 146}, 1);
  // What old programs write of sRGB.
  WritePng(file, Flat({200, 100, 50}));
  InsertPngChunk(file, "cHRM", Chromaticities(dtr::testing::kSrgb));
  InsertPngChunk(file, "gAMA", BigEndian(45455));
  ExpectFlat(file, {200, 100, 50}, 0);
  WritePng(file, Flat(kRedInP3));
  InsertPngChunk(file, "cHRM", Chromaticities(dtr::testing::kDisplayP3));
  InsertPngChunk(file, "gAMA", BigEndian(45455));
  ExpectFlat(file, kRed, 3);
  // sRGB goes before both.
  InsertPngChunk(file, "sRGB", std::string(1, '\0'));
  ExpectFlat(file, kRedInP3, 0);
}

TEST(PhotoColours, NumbersOfPngAndWhatTheyDoNotSupport) {
  const TemporaryFolder folder;
  const fs::path file = folder / "photo.png";
  WritePng(file, Flat(kRedInP3));
  InsertPngChunk(file, "cICP", {12, 13, 0, 1});
  ExpectFlat(file, kRed, 3);
  // 58 % of PQ is reference white, 203 cd/m2, which becomes 247.
  WritePng(file, Flat({148, 148, 148}));
  InsertPngChunk(file, "cICP", {9, 16, 0, 1});
  ExpectFlat(file, {247, 247, 247}, 1);
  WritePng(file, Flat({148, 148, 148}));
  InsertPngChunk(file, "cICP", {9, 10, 0, 1});
  EXPECT_THAT(MessageOf<Error>([&] { ReadImageHeader(file); }),
              HasSubstr("photo.png: colours of primaries 9 and transfer function 10"));
}

TEST(PhotoColours, LightOfHdrIsThatOfTheStandards) {
  ColourCoding coding;
  coding.transfer = Transfer::kPq;  // ITU-R BT.2100: 100 cd/m2 are 0.508, 10000 are 1
  EXPECT_NEAR(LightOf(coding, 0.508078) * 203, 100, 0.01);
  EXPECT_NEAR(LightOf(coding, 1) * 203, 10000, 1e-6);
  EXPECT_EQ(LightOf(coding, 0), 0);
  coding.transfer = Transfer::kHlg;  // 1/12 of the scene's light is 0.5, all of it 1
  EXPECT_NEAR(LightOf(coding, 0.5) * 203 / 1000, 1.0 / 12, 1e-9);
  EXPECT_NEAR(LightOf(coding, 1) * 203 / 1000, 1, 1e-7);
}

// One frame of these 10-bit samples as AVIF, which shares HEIF's boxes.
void WriteAvif(const TemporaryFolder& folder, const std::string& name, const Colour& yuv,
               const std::vector<std::string>& tags) {
  constexpr int kSide = 64;
  std::string bytes;
  for (size_t plane = 0; plane < 3; ++plane) {
    for (int i = 0; i < kSide * kSide; ++i) {
      bytes += static_cast<char>(yuv[plane] & 255);
      bytes += static_cast<char>(yuv[plane] >> 8);
    }
  }
  WriteFileAtomically(folder / "flat.yuv", bytes);
  // Tags go to the input: of the output alone, FFmpeg 7 ignores some.
  std::vector<std::string> command{"ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo"};
  const auto add = [&command](const std::vector<std::string>& words) {
    command.insert(command.end(), words.begin(), words.end());
  };
  add({"-pix_fmt", "yuv444p10le", "-s", "64x64", "-color_range", "pc"});
  add(tags);
  add({"-i", "flat.yuv", "-c:v", "libaom-av1", "-still-picture", "1", "-crf", "0"});
  add({"-pix_fmt", "yuv444p10le"});
  command.push_back(name);
  ProcessOptions options;
  options.working_directory = folder.path();
  options.log_file = folder / "ffmpeg.log";
  ASSERT_TRUE(RunProcess(command, options).Ok()) << ReadFile(folder / "ffmpeg.log", 1 << 20);
}

TEST(PhotoColours, NumbersOfHeifAreApplied) {
  const TemporaryFolder folder;
  // P3's red of kRedInP3 in full-range BT.601 of 10 bits, by hand: Y 0.413, Cb -0.156, Cr 0.360.
  WriteAvif(
      folder, "p3.avif", {423, 353, 880},
      {"-color_primaries", "smpte432", "-color_trc", "iec61966-2-1", "-colorspace", "smpte170m"});
  ExpectFlat(folder / "p3.avif", kRed, 8);
  WriteAvif(folder, "pq.avif", {594, 512, 512},
            {"-color_primaries", "bt2020", "-color_trc", "smpte2084", "-colorspace", "bt2020nc"});
  ExpectFlat(folder / "pq.avif", {247, 247, 247}, 2);
}

TEST(PhotoColours, PrimariesOfExrAreApplied) {
  const TemporaryFolder folder;
  ImageSpec spec(kW, kH, 3, TypeDesc::FLOAT);
  const std::array<float, 8> p3{0.680F, 0.320F, 0.265F, 0.690F, 0.150F, 0.060F, 0.3127F, 0.3290F};
  spec.attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), p3.data());
  std::vector<float> values;  // sRGB's red in linear P3
  for (int i = 0; i < kW * kH; ++i) values.insert(values.end(), {0.8225F, 0.0332F, 0.0171F});
  WriteForeign(folder / "p3.exr", spec, values);
  ExpectFlat(folder / "p3.exr", kRed, 3);
  WriteForeign(folder / "plain.exr", {kW, kH, 3, TypeDesc::HALF},
               std::vector<float>(3 * kW * kH, 0.5F));
  ExpectFlat(folder / "plain.exr", {188, 188, 188}, 0);
}

// The products of what a float can hold with a matrix may be infinite, their differences no number.
TEST(PhotoColours, TheLargestFloatsAreBrightAndNoCrash) {
  const TemporaryFolder folder;
  const std::array<float, 8> aces{0.7347F, 0.2653F, 0.0F,     1.0F,
                                  0.0001F, -0.077F, 0.32168F, 0.33767F};
  for (const float value : {3.4e38F, -3.4e38F, 1e-39F}) {
    ImageSpec spec(kW, kH, 3, TypeDesc::FLOAT);
    spec.attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), aces.data());
    WriteForeign(folder / "large.exr", spec, std::vector<float>(3 * kW * kH, value));
    const int level = value > 1 ? 255 : 0;
    ExpectFlat(folder / "large.exr", {level, level, level}, 0);
  }
  ImageSpec spec(kW, kH, 4, TypeDesc::FLOAT);  // premultiplied: colour / alpha is infinite
  spec.channelnames = {"R", "G", "B", "A"};
  spec.alpha_channel = 3;
  spec.attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), aces.data());
  std::vector<float> values;
  for (int i = 0; i < kW * kH; ++i) values.insert(values.end(), {0.5F, 0.5F, 0.5F, 1e-39F});
  WriteForeign(folder / "thin.exr", spec, values);
  ExpectFlat(folder / "thin.exr", {255, 255, 255}, 0);
}

TEST(PhotoColours, WindowsAndChannelsOfExrThatAreNoPhotoAreAnError) {
  const TemporaryFolder folder;
  ImageSpec spec(kW, kH, 3, TypeDesc::HALF);
  const std::vector<float> values(3 * kW * kH, 0.5F);
  spec.x = spec.full_x = 5;  // both moved alike
  WriteForeign(folder / "moved.exr", spec, values);
  ExpectFlat(folder / "moved.exr", {188, 188, 188}, 0);
  for (const int larger : {-4, 4}) {
    ImageSpec other(kW, kH, 3, TypeDesc::HALF);
    other.full_width = kW + larger;
    WriteForeign(folder / "window.exr", other, values);
    fs::copy_file(folder / "window.exr", folder / "capital.EXR",
                  fs::copy_options::overwrite_existing);
    EXPECT_THROW(ReadImage(folder / "capital.EXR"), Error);
    for (const auto& read :
         {std::function<void()>([&] { ReadImage(folder / "window.exr"); }),
          std::function<void()>([&] { ReadImageHeader(folder / "window.exr"); })}) {
      EXPECT_THAT(MessageOf<Error>(read), HasSubstr("its data window (16x8 from 0, 0) is not its "
                                                    "display window"));
    }
  }
  ImageSpec normals(kW, kH, 3, TypeDesc::HALF);
  normals.channelnames = {"N.X", "N.Y", "N.Z"};
  WriteForeign(folder / "normals.exr", normals, values);
  EXPECT_THAT(MessageOf<Error>([&] { ReadImageHeader(folder / "normals.exr"); }),
              HasSubstr("its channels are N.X, N.Y, N.Z"));
  ImageSpec chroma(kW, kH, 3, TypeDesc::HALF);
  chroma.channelnames = {"BY", "RY", "Y"};
  WriteForeign(folder / "chroma.exr", chroma, values);
  EXPECT_THAT(MessageOf<Error>([&] { ReadImageHeader(folder / "chroma.exr"); }),
              HasSubstr("a luminance-chroma EXR is not supported"));
  ImageSpec layers(kW, kH, 5, TypeDesc::HALF);
  layers.channelnames = {"R", "G", "B", "Z", "id"};
  WriteForeign(folder / "layers.exr", layers, std::vector<float>(5 * kW * kH, 0.5F));
  EXPECT_THAT(ReadImageHeader(folder / "layers.exr").remarks,
              Contains("of its 5 channels only the colours are used"));
}

TEST(PhotoColours, KindsOfTiffHaveTheirColours) {
  const TemporaryFolder folder;
  const fs::path file = folder / "photo.tif";
  // 258 bits, 262 photometric, 277 samples, 320 palette, 332 inks.
  const auto flat = [](std::string pixel) {
    std::string all;
    for (int i = 0; i < kW * kH; ++i) all += pixel;
    return all;
  };
  WriteTiff(file, kW, kH, {{258, {8}}, {262, {0}}, {277, {1}}}, flat("\x37"));  // 55 from white
  ExpectFlat(file, {200, 200, 200}, 0);
  WriteTiff(file, kW, kH, {{258, {1}}, {262, {1}}, {277, {1}}}, std::string(kW / 8 * kH, '\xff'));
  ExpectFlat(file, {255, 255, 255}, 0);
  WriteTiff(file, kW, kH, {{258, {1}}, {262, {0}}, {277, {1}}}, std::string(kW / 8 * kH, '\xff'));
  ExpectFlat(file, {0, 0, 0}, 0);
  WriteTiff(file, kW, kH, {{258, {4}}, {262, {1}}, {277, {1}}}, std::string(kW / 2 * kH, '\xaa'));
  ExpectFlat(file, {170, 170, 170}, 0);
  std::vector<std::uint32_t> palette(3 * 256, 0);
  palette[7] = 200 * 257;
  palette[256 + 7] = 100 * 257;
  palette[512 + 7] = 50 * 257;
  WriteTiff(file, kW, kH, {{258, {8}}, {262, {3}}, {277, {1}}, {320, palette}}, flat("\x07"));
  ExpectFlat(file, {200, 100, 50}, 0);
  WriteTiff(file, kW, kH, {{258, {16, 16, 16}}, {262, {2}}, {277, {3}}},
            flat({'\x80', '\xc8', '\x80', '\x64', '\x80', '\x32'}));  // 200.5, 100.5, 50.5 of 257
  ExpectFlat(file, {200, 100, 50}, 0);
  WriteTiff(file, kW, kH, {{258, {8, 8, 8, 8}}, {262, {5}}, {277, {4}}, {332, {1}}},
            flat({'\x37', '\x9b', '\xcd', '\x00'}));
  ExpectFlat(file, {200, 100, 50}, 1);
}

TEST(PhotoColours, LabTiffIsAnError) {
  const TemporaryFolder folder;
  const fs::path file = folder / "lab.tif";
  std::string pixels;  // L 50 of 100, a = b = 0: 119 in sRGB
  for (int i = 0; i < kW * kH; ++i) pixels += std::string{'\x80', '\x00', '\x00'};
  WriteTiff(file, kW, kH, {{258, {8, 8, 8}}, {262, {8}}, {277, {3}}}, pixels);
  EXPECT_THAT(MessageOf<Error>([&] { ReadImageHeader(file); }),
              HasSubstr("lab.tif: a TIFF of Lab colours is not supported"));
}

// A JPEG of one colour.
void WriteFlatJpeg(const fs::path& file, const std::vector<JSAMPLE>& pixel,
                   const testing::JpegKind& kind) {
  std::vector<JSAMPLE> values;
  for (int i = 0; i < kW * kH; ++i) values.insert(values.end(), pixel.begin(), pixel.end());
  testing::WriteJpegAs(file, kW, kH, std::move(values), kind);
}

TEST(PhotoColours, KindsOfJpegHaveTheirColours) {
  const TemporaryFolder folder;
  const fs::path file = folder / "photo.jpg";
  for (const auto& [across, down] : {std::pair(1, 1), {1, 2}, {2, 1}, {2, 2}, {4, 1}, {4, 2}}) {
    WriteFlatJpeg(file, {200, 100, 50}, {JCS_RGB, JCS_YCbCr, false, across, down});
    ExpectFlat(file, {200, 100, 50}, 2);
  }
  WriteFlatJpeg(file, {200, 100, 50}, {JCS_RGB, JCS_RGB, true, 1, 1});  // marker: no transform
  ExpectFlat(file, {200, 100, 50}, 1);
  // Adobe's inks are inverted, coded as they are or through YCC.
  WriteFlatJpeg(file, {200, 100, 50, 255}, {JCS_CMYK, JCS_CMYK, true, 1, 1});
  ExpectFlat(file, {200, 100, 50}, 2);
  WriteFlatJpeg(file, {200, 100, 50, 255}, {JCS_CMYK, JCS_YCCK, true, 2, 2});
  ExpectFlat(file, {200, 100, 50}, 2);
}

// EXIF of one entry, Orientation (TIFF 6.0), little-endian.
std::string ExifOf(int orientation) {
  std::string exif("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", 18);
  exif += static_cast<char>(orientation);
  return exif + std::string(7, '\0');
}

TEST(PhotoColours, OrientationIsAppliedOnceWhereverItStands) {
  const TemporaryFolder folder;
  ImageRgb8 image(kW, kH, 3, 60);
  image(0, 0, 0) = 250;
  WritePng(folder / "a.png", image);
  InsertPngChunk(folder / "a.png", "eXIf", ExifOf(6));
  ImageSpec spec(kW, kH, 3, TypeDesc::UINT8);
  spec.attribute("Orientation", 6);
  WriteForeign<std::uint8_t>(folder / "a.tif", spec, {image.data().begin(), image.data().end()});
  for (const char* name : {"a.png", "a.tif"}) {
    EXPECT_EQ(ReadImageHeader(folder / name).exif_orientation, 6) << name;
    EXPECT_EQ(ReadImage(folder / name, {.apply_exif_orientation = true}),
              ApplyExifOrientation(image, 6))
        << name;
  }
  // HEIF rotates by properties of its own, which the decoder applies; EXIF is to be ignored.
  ImageRgb8 large(64, 64, 3, 60);
  ImageSpec heif(64, 64, 3, TypeDesc::UINT8);
  heif.attribute("Orientation", 6);
  WriteForeign<std::uint8_t>(folder / "a.heic", heif, {large.data().begin(), large.data().end()});
  EXPECT_EQ(ReadImageHeader(folder / "a.heic").exif_orientation, 1);
}

TEST(PhotoColours, OrientationOfWebPIsApplied) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.webp";
  const ImageRgb8 image = Flat({200, 100, 50});
  WriteForeign<std::uint8_t>(file, ImageSpec(kW, kH, 3, TypeDesc::UINT8),
                             {image.data().begin(), image.data().end()});
  const std::string plain = ReadFile(file, 1 << 20);
  const auto little = [](size_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 255);
    return text;
  };
  const std::string chunks = "VP8X" + little(10, 4) + little(0x08, 4) + little(kW - 1, 3) +
                             little(kH - 1, 3) + plain.substr(plain.find("VP8", 12)) + "EXIF" +
                             little(ExifOf(6).size(), 4) + ExifOf(6);
  WriteFileAtomically(file, "RIFF" + little(chunks.size() + 4, 4) + "WEBP" + chunks);
  EXPECT_EQ(ReadImageHeader(file).exif_orientation, 6);
  EXPECT_EQ(ReadImage(file, {.apply_exif_orientation = true}).width(), kH);
}

TEST(PhotoColours, SeveralImagesInAFileAreRemarked) {
  const TemporaryFolder folder;
  const fs::path file = folder / "pages.tif";
  const auto out = OIIO::ImageOutput::create(file.string());
  const std::vector<ImageSpec> specs(2, ImageSpec(kW, kH, 3, TypeDesc::UINT8));
  ASSERT_TRUE(out->open(file.string(), 2, specs.data()));
  ASSERT_TRUE(out->write_image(TypeDesc::UINT8, Flat({200, 100, 50}).data().data()));
  ASSERT_TRUE(out->open(file.string(), specs[1], OIIO::ImageOutput::AppendSubimage));
  ASSERT_TRUE(out->write_image(TypeDesc::UINT8, Flat({1, 2, 3}).data().data()));
  ASSERT_TRUE(out->close());
  ExpectFlat(file, {200, 100, 50}, 0);
  EXPECT_THAT(ReadImageHeader(file).remarks,
              Contains("holds more than one image; the first is used"));
}

TEST(PhotoColours, FilesCutAnywhereStateNothingWrong) {
  const TemporaryFolder folder;
  const fs::path file = folder / "photo.png";
  WritePng(file, Flat(kRedInP3));
  InsertPngChunk(file, "cHRM", std::string(32, '\0'));  // white at 0, 0
  EXPECT_THAT(MessageOf<Error>([&] { ReadImageHeader(file); }), HasSubstr("span no colours"));
  WriteAvif(folder, "p3.avif", {423, 353, 880},
            {"-color_primaries", "smpte432", "-color_trc", "iec61966-2-1"});
  const std::string whole = ReadFile(folder / "p3.avif", 1 << 20);
  for (size_t length = 0; length < whole.size(); length += 3) {
    WriteFileAtomically(folder / "cut.avif", whole.substr(0, length));
    try {
      ReadImageHeader(folder / "cut.avif");
    } catch (const Error&) {  // neither a crash nor anything else
    }
  }
}

}  // namespace
}  // namespace dtr::io
