#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using testing::TemporaryFolder;

constexpr std::array<float, 3> kVisible{0.8f, 0.4f, 0.2f}, kHidden{1.0f, 0.0f, 1.0f};
constexpr int kSide = 32;

// Four columns of 8 pixels: transparent over magenta, alpha 0.25, alpha 0.75 and opaque, all but
// the first of the visible colour.
float AlphaAt(int x) {
  return std::array<float, 4>{0, 0.25f, 0.75f, 1}[static_cast<size_t>(x / 8)];
}

struct Kind {
  const char* name;
  OIIO::TypeDesc::BASETYPE type;
  bool straight;
  int tolerance;  // of colours, of 255: 8-bit premultiplied at alpha 0.75, or lossy
};

void WriteFour(const fs::path& file, const Kind& kind) {
  OIIO::ImageSpec spec(kSide, kSide, 4, OIIO::TypeDesc(kind.type));
  if (kind.straight) spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("CompressionQuality", 100);
  std::vector<float> values;
  for (int i = 0; i < kSide * kSide; ++i) {
    const float alpha = AlphaAt(i % kSide);
    // OpenImageIO 2.4 divides by alpha in light of gamma 2.2 as it writes WebP, whatever it is
    // told.
    const float share = kind.straight                 ? 1
                        : file.extension() == ".webp" ? std::pow(alpha, 1 / 2.2f)
                                                      : alpha;
    for (const float value : alpha == 0 ? kHidden : kVisible) {
      values.push_back(value * share);
    }
    values.push_back(alpha);
  }
  const auto out = OIIO::ImageOutput::create(file.string());
  ASSERT_TRUE(out && out->open(file.string(), spec) &&
              out->write_image(OIIO::TypeDesc::FLOAT, values.data()) && out->close());
}

std::uint8_t Coded(float value, bool linear) {
  if (!linear) return static_cast<std::uint8_t>(std::lround(255 * value));
  return static_cast<std::uint8_t>(
      std::lround(255 * (1.055 * std::pow(static_cast<double>(value), 1 / 2.4) - 0.055)));
}

TEST(ReadImageAndMask, TransparentPixelsAreMaskedAndTheirColoursGoneInEveryFormat) {
  const TemporaryFolder folder;
  using OIIO::TypeDesc;
  for (const Kind& kind :
       {Kind{"a.png", TypeDesc::UINT8, true, 0}, Kind{"b.png", TypeDesc::UINT16, true, 0},
        Kind{"c.tif", TypeDesc::UINT8, true, 0}, Kind{"d.tif", TypeDesc::UINT16, true, 0},
        Kind{"e.tif", TypeDesc::UINT8, false, 1}, Kind{"f.tif", TypeDesc::UINT16, false, 1},
        Kind{"g.exr", TypeDesc::HALF, false, 1}, Kind{"h.tif", TypeDesc::FLOAT, true, 0},
        Kind{"i.tif", TypeDesc::FLOAT, false, 0}, Kind{"j.tga", TypeDesc::UINT8, true, 0},
        Kind{"k.webp", TypeDesc::UINT8, false, 6}, Kind{"l.heic", TypeDesc::UINT8, true, 6}}) {
    SCOPED_TRACE(kind.name);
    const fs::path file = folder / kind.name;
    WriteFour(file, kind);
    EXPECT_TRUE(ReadImageHeader(file).has_alpha);
    const ImageAndMask read = ReadImageAndMask(file);
    ASSERT_FALSE(read.mask.empty());
    const bool linear = kind.type == TypeDesc::HALF || kind.type == TypeDesc::FLOAT;
    int wrong = 0, magenta = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        EXPECT_EQ(read.mask(x, y), AlphaAt(x) >= 0.5f ? 255 : 0) << x;
        // A lossy coder bleeds within its blocks of chroma.
        const bool near_hidden = x < 16;
        for (int c = 0; c < 3; ++c) {
          const int off =
              std::abs(read.image(x, y, c) - Coded(kVisible[static_cast<size_t>(c)], linear));
          wrong += off > kind.tolerance && !near_hidden;
          magenta += off > kind.tolerance + 12;  // filled from the visible ones
        }
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(magenta, 0);
    EXPECT_EQ(read.alpha.transparent_px, kSide * kSide / 4);
    EXPECT_EQ(read.alpha.partial_px, kSide * kSide / 2);
    EXPECT_EQ(ReadImage(file), read.image);
  }
}

std::uint32_t Crc(const std::string& bytes) {  // PNG specification, annex D
  std::uint32_t crc = 0xffffffffu;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int k = 0; k < 8; ++k) crc = (crc & 1) != 0 ? 0xedb88320u ^ (crc >> 1) : crc >> 1;
  }
  return ~crc;
}

std::string BigEndian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
          static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string Chunk(const std::string& type, const std::string& data) {
  return BigEndian(static_cast<std::uint32_t>(data.size())) + type + data +
         BigEndian(Crc(type + data));
}

// A PNG of 8 bits a sample in rows with a filter byte, deflated as one stored block.
std::string Png(int width, int height, int colour_type, const std::string& extra,
                const std::string& rows) {
  std::uint32_t a = 1, b = 0;
  for (const char byte : rows) {
    a = (a + static_cast<unsigned char>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  const auto size = static_cast<std::uint16_t>(rows.size());
  const std::string stored{'\x78',
                           '\x01',
                           '\x01',
                           static_cast<char>(size & 255),
                           static_cast<char>(size >> 8),
                           static_cast<char>(~size & 255),
                           static_cast<char>((~size & 0xffff) >> 8)};
  return "\x89PNG\r\n\x1a\n" +
         Chunk("IHDR", BigEndian(static_cast<std::uint32_t>(width)) +
                           BigEndian(static_cast<std::uint32_t>(height)) + '\x08' +
                           static_cast<char>(colour_type) + std::string(3, '\0')) +
         extra + Chunk("IDAT", stored + rows + BigEndian(b << 16 | a)) + Chunk("IEND", "");
}

TEST(ReadImageAndMask, PalettesColourKeysAndGreyWithAlphaAreAlphaToo) {
  const TemporaryFolder folder;
  const std::string palette = Chunk("PLTE", std::string("\xff\x00\xff\x10\x20\x30", 6));
  WriteFileAtomically(
      folder / "palette.png",
      Png(2, 1, 3, palette + Chunk("tRNS", std::string("\0", 1)), std::string("\0\0\1", 3)));
  WriteFileAtomically(folder / "key.png",
                      Png(2, 1, 2, Chunk("tRNS", std::string("\0\xff\0\0\0\xff", 6)),
                          std::string("\0\xff\0\xff\x10\x20\x30", 7)));
  WriteFileAtomically(folder / "grey.png", Png(2, 1, 4, "", std::string("\0\xff\0\x20\xff", 5)));
  for (const char* name : {"palette.png", "key.png", "grey.png"}) {
    const ImageAndMask read = ReadImageAndMask(folder / name);
    EXPECT_EQ(read.mask.data(), (std::vector<std::uint8_t>{0, 255})) << name;
    const int red = std::string(name) == "grey.png" ? 0x20 : 0x10;
    EXPECT_EQ(read.image(1, 0, 0), red) << name;
    EXPECT_EQ(read.image(0, 0, 0), red) << name << ": the hidden colour is gone";
    EXPECT_EQ(read.alpha.transparent_px, 1);
    EXPECT_EQ(read.alpha.partial_px, 0);
  }
}

TEST(ReadImageAndMask, OpaqueAlphaIsNoMaskAndTransparentPhotosHaveNothing) {
  const TemporaryFolder folder;
  ImageRgb8 image(4, 3, 3, 77);
  image(1, 1, 0) = 200;
  WriteImageWithAlpha(folder / "opaque.png", image, Mask(4, 3, 1, 255));
  const ImageAndMask opaque = ReadImageAndMask(folder / "opaque.png");
  EXPECT_TRUE(opaque.mask.empty());
  EXPECT_FALSE(opaque.alpha.any());
  EXPECT_EQ(opaque.image, image);
  WriteImageWithAlpha(folder / "clear.png", image, Mask(4, 3));
  EXPECT_EQ(ReadImageAndMask(folder / "clear.png").mask, Mask(4, 3));
}

TEST(ReadImageAndMask, HalfAlphaIsWhereUseBegins) {
  const TemporaryFolder folder;
  Mask alpha(3, 1);
  alpha.data() = {127, 128, 1};
  WriteImageWithAlpha(folder / "a.png", ImageRgb8(3, 1, 3, 50), alpha);
  const ImageAndMask read = ReadImageAndMask(folder / "a.png");
  EXPECT_EQ(read.mask.data(), (std::vector<std::uint8_t>{0, 255, 0}));
  EXPECT_EQ(read.alpha.transparent_px, 0);
  EXPECT_EQ(read.alpha.partial_px, 3);
}

TEST(ReadMask, AMaskWithAlphaMustBeBrightAndOpaque) {
  const TemporaryFolder folder;
  Mask alpha(3, 1);
  alpha.data() = {255, 0, 255};
  ImageRgb8 image(3, 1, 3, 255);
  image(2, 0, 0) = 0;
  WriteImageWithAlpha(folder / "m.png", image, alpha);
  EXPECT_EQ(ReadMask(folder / "m.png").data(), (std::vector<std::uint8_t>{255, 0, 0}));
}

}  // namespace
}  // namespace dtr::io
