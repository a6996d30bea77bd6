#include "dtr/io/heif_exif.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/support/dng_file.h"
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

// What a camera's EXIF holds: TIFF 6.0 and EXIF 2.3, little-endian.
std::string ExifTiff(int orientation) {
  using namespace dtr::testing::dng_detail;
  const auto entries = [&](size_t exif_at) {
    return std::vector<Entry>{Text(271, "Other"), Text(272, "Phone"), Shorts(274, {orientation}),
                              Long(34665, exif_at)};
  };
  constexpr size_t kFirst = 8;
  const size_t exif_at = kFirst + Directory(entries(0), kFirst).size();
  std::string head = "II";
  Put(head, 42, 2);
  Put(head, kFirst, 4);
  return head + Directory(entries(exif_at), kFirst) +
         Directory({Rationals(37386, 5, {4.25}), Shorts(41989, {26})}, exif_at);
}

// Puts it into the place of the item that OpenImageIO wrote, which has the word Exif and a wrong
// offset: behind `before`, as the offset then says.
void ReplaceExif(const fs::path& file, const std::string& before, const std::string& tiff) {
  std::string content = ReadFile(file, kLimit);
  const size_t word = content.rfind(std::string("Exif\0\0MM", 8));
  ASSERT_NE(word, std::string::npos);
  std::string item(3, '\0');
  item += static_cast<char>(before.size());
  item += before + tiff;
  ASSERT_LE(word - 4 + item.size(), content.size());
  content.replace(word - 4, item.size(), item);
  WriteFileAtomically(file, content);
}

void ExpectCamera(const ImageHeader& header) {
  ASSERT_TRUE(header.focal_mm && header.focal_35mm);
  EXPECT_NEAR(*header.focal_mm, 4.25, 1e-6);
  EXPECT_EQ(*header.focal_35mm, 26);
  EXPECT_EQ(header.model, "Phone");
}

TEST(HeifExif, FocalLengthIsReadWhereverTheItemHasIt) {
  const TemporaryFolder folder;
  for (const char* name : {"a.heic", "a.avif"}) {
    WritePhoto(folder / name);
    ExpectCamera(ReadImageHeader(folder / name));
    EXPECT_EQ(ReadImageHeader(folder / name).make, "Maker");
    for (const std::string& before :
         {std::string("Exif\0\0", 6), std::string(), std::string(11, '.')}) {
      WritePhoto(folder / name);
      ReplaceExif(folder / name, before, ExifTiff(1));
      ExpectCamera(ReadImageHeader(folder / name));
      EXPECT_EQ(ReadImageHeader(folder / name).make, "Other") << before.size();
    }
  }
}

TEST(HeifExif, TheDecoderTurnsAndExifDoesNot) {
  const TemporaryFolder folder;
  WritePhoto(folder / "a.heic", 6);
  ReplaceExif(folder / "a.heic", "", ExifTiff(6));
  const ImageHeader header = ReadImageHeader(folder / "a.heic");
  EXPECT_EQ(header.exif_orientation, 1);
  const ImageRgb8 image = ReadImage(folder / "a.heic", {.apply_exif_orientation = true});
  EXPECT_EQ(image.width(), header.width_px);
  EXPECT_EQ(image.height(), header.height_px);
}

TEST(HeifExif, EveryTruncationHasTheSameOrNone) {
  const TemporaryFolder folder;
  WritePhoto(folder / "a.heic");
  ReplaceExif(folder / "a.heic", "", ExifTiff(1));
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
  ReplaceExif(folder / "a.heic", "", ExifTiff(1));
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
