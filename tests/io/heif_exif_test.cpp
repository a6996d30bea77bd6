#include "dtr/io/heif_exif.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;

constexpr std::uintmax_t kLimit = 1 << 20;

// A photo of a camera in HEIC or AVIF, as OpenImageIO (libheif) writes it.
void WritePhoto(const fs::path& file, int orientation = 1) {
  const int width = 96, height = 64;
  OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Make", "Maker");
  spec.attribute("Model", "Phone");
  spec.attribute("Exif:FocalLength", 4.25f);
  spec.attribute("Exif:FocalLengthIn35mmFilm", 26);
  spec.attribute("Orientation", orientation);
  const std::vector<std::uint8_t> pixels(static_cast<size_t>(3 * width * height), 90);
  auto out = OIIO::ImageOutput::create(file.string());
  ASSERT_TRUE(out && out->open(file.string(), spec) &&
              out->write_image(OIIO::TypeDesc::UINT8, pixels.data()) && out->close())
      << OIIO::geterror();
}

// The Exif item as other programs have it: nothing between the offset and the TIFF structure.
void DropExifWord(const fs::path& file) {
  std::string content = ReadFile(file, kLimit);
  const std::string usual("\0\0\0\6Exif\0\0", 10);
  const size_t at = content.find(usual);
  ASSERT_NE(at, std::string::npos);
  const std::string tiff = ReadHeifExif(file);
  ASSERT_FALSE(tiff.empty());
  content.replace(at, 4 + 6 + tiff.size(), std::string(4, '\0') + tiff + std::string(6, '\0'));
  WriteFileAtomically(file, content);
}

void ExpectCamera(const ImageHeader& header) {
  ASSERT_TRUE(header.focal_mm && header.focal_35mm);
  EXPECT_NEAR(*header.focal_mm, 4.25, 1e-6);
  EXPECT_EQ(*header.focal_35mm, 26);
  EXPECT_EQ(header.make, "Maker");
  EXPECT_EQ(header.model, "Phone");
}

TEST(HeifExif, FocalLengthIsReadWhereverTheItemHasIt) {
  const TemporaryFolder folder;
  for (const char* name : {"a.heic", "a.avif"}) {
    WritePhoto(folder / name);
    ExpectCamera(ReadImageHeader(folder / name));
    DropExifWord(folder / name);
    ExpectCamera(ReadImageHeader(folder / name));
  }
}

TEST(HeifExif, TheDecoderTurnsAndExifDoesNot) {
  const TemporaryFolder folder;
  WritePhoto(folder / "a.heic", 6);
  DropExifWord(folder / "a.heic");
  const ImageHeader header = ReadImageHeader(folder / "a.heic");
  EXPECT_EQ(header.exif_orientation, 1);
  const ImageRgb8 image = ReadImage(folder / "a.heic", {.apply_exif_orientation = true});
  EXPECT_EQ(image.width(), header.width_px);
  EXPECT_EQ(image.height(), header.height_px);
}

TEST(HeifExif, EveryTruncationHasTheSameOrNone) {
  const TemporaryFolder folder;
  WritePhoto(folder / "a.heic");
  const std::string content = ReadFile(folder / "a.heic", kLimit),
                    tiff = ReadHeifExif(folder / "a.heic");
  ASSERT_FALSE(tiff.empty());
  int same = 0;
  for (size_t length = 0; length < content.size(); length += 3) {
    WriteFileAtomically(folder / "b.heic", content.substr(0, length));
    const std::string of_part = ReadHeifExif(folder / "b.heic");
    EXPECT_TRUE(of_part.empty() || of_part == tiff) << length;
    same += of_part == tiff;
  }
  EXPECT_LT(same, static_cast<int>(content.size() / 3));
}

TEST(HeifExif, BrokenNumbersGiveNothing) {
  const TemporaryFolder folder;
  WritePhoto(folder / "a.heic");
  const std::string content = ReadFile(folder / "a.heic", kLimit),
                    tiff = ReadHeifExif(folder / "a.heic");
  const size_t end = content.find("mdat");
  ASSERT_NE(end, std::string::npos);
  // Every byte of the boxes before the data, at its largest: offsets, lengths and counts.
  for (size_t at = 0; at < end; ++at) {
    std::string broken = content;
    broken[at] = '\xff';
    WriteFileAtomically(folder / "b.heic", broken);
    const std::string found = ReadHeifExif(folder / "b.heic");
    EXPECT_LE(found.size(), content.size()) << at;
  }
}

}  // namespace
}  // namespace dtr::io
