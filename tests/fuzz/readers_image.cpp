// Photos and masks. Decoders are others' (OpenImageIO and below it libjpeg, libpng, libtiff,
// OpenEXR): what is tried is that our reader holds them to a size, and that damage ends in an
// Error.
#include <OpenImageIO/imageio.h>

#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/heif_exif.h"
#include "dtr/io/image_io.h"
#include "tests/fuzz/readers.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;
constexpr std::uint64_t kLimitPx = 1 << 20;  // 3 MB as 8 bits, 12 MB as float

ImageRgb8 SomeImage() {
  ImageRgb8 image(24, 18, 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = static_cast<std::uint8_t>(10 * x + 3 * y * (c + 1) + (x * y * 7) % 13);
      }
    }
  }
  return image;
}

Reader ReaderOf(const fs::path& file, std::vector<std::string> seeds) {
  return {file, std::move(seeds),
          [=] {
            io::ReadImageHeader(file);
            io::ReadImage(file, {.apply_exif_orientation = true, .limit_px = kLimitPx});
            io::ReadMask(file, kLimitPx);
          },
          kImageBufferBytes};
}

Reader OpenJpeg(const fs::path& folder) {
  const fs::path file = folder / "photo.jpg";
  std::vector<std::string> seeds;
  io::WriteImage(file, SomeImage());
  seeds.push_back(ReadFile(file, kSeedLimitBytes));
  io::WriteJpegWithExif(file, SomeImage(), 90, {5.0, 28.0, "Maker", "Model"});
  seeds.push_back(ReadFile(file, kSeedLimitBytes));
  ImageRgb8 panorama(24, 12, 3);
  io::WritePanoramaJpeg(file, panorama, 90);
  seeds.push_back(ReadFile(file, kSeedLimitBytes));
  return ReaderOf(file, std::move(seeds));
}

// EXIF of HEIF is read by our own code; its pixels are libheif's affair.
Reader OpenHeifExif(const fs::path& folder) {
  const fs::path file = folder / "photo.heic";
  OIIO::ImageSpec spec(64, 64, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Make", "Maker");
  spec.attribute("Exif:FocalLength", 4.25f);
  const std::vector<std::uint8_t> pixels(64 * 64 * 3, 80);
  const auto out = OIIO::ImageOutput::create(file.string());
  if (!out || !out->open(file.string(), spec) ||
      !out->write_image(OIIO::TypeDesc::UINT8, pixels.data()) || !out->close()) {
    throw Error(file.string() + ": cannot be written: " + OIIO::geterror());
  }
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] { (void)io::ReadHeifExif(file); }, 0};
}

Reader OpenPng(const fs::path& folder) {
  const fs::path file = folder / "photo.png";
  std::vector<std::string> seeds;
  io::WriteImage(file, SomeImage());
  seeds.push_back(ReadFile(file, kSeedLimitBytes));
  io::WriteImageWithAlpha(file, SomeImage(), Mask(24, 18, 1, 128));
  seeds.push_back(ReadFile(file, kSeedLimitBytes));
  io::WriteMask(file, Mask(24, 18, 1, 255));
  seeds.push_back(ReadFile(file, kSeedLimitBytes));
  return ReaderOf(file, std::move(seeds));
}

Reader OpenExr(const fs::path& folder) {
  const fs::path file = folder / "photo.exr";
  io::WriteExr(file, Grid<float>(24, 18, 1, 0.25f), true);
  return ReaderOf(file, {ReadFile(file, kSeedLimitBytes)});
}

// 8 and 16 bits, packed and not.
Reader OpenTiff(const fs::path& folder) {
  const fs::path file = folder / "photo.tif";
  const ImageRgb8 image = SomeImage();
  std::vector<std::string> seeds;
  for (const auto& [type, packing] :
       {std::pair(OIIO::TypeDesc::UINT8, "none"), std::pair(OIIO::TypeDesc::UINT16, "lzw"),
        std::pair(OIIO::TypeDesc::UINT8, "zip")}) {
    OIIO::ImageSpec spec(image.width(), image.height(), 3, type);
    spec.attribute("compression", packing);
    const auto out = OIIO::ImageOutput::create(file.string());
    if (!out || !out->open(file.string(), spec) ||
        !out->write_image(OIIO::TypeDesc::UINT8, image.data().data()) || !out->close()) {
      throw Error(file.string() + ": cannot be written: " + OIIO::geterror());
    }
    seeds.push_back(ReadFile(file, kSeedLimitBytes));
  }
  return ReaderOf(file, std::move(seeds));
}

constexpr ReaderKind kReaders[] = {{"jpeg", OpenJpeg},
                                   {"heif_exif", OpenHeifExif},
                                   {"png", OpenPng},
                                   {"exr", OpenExr},
                                   {"tiff", OpenTiff}};

}  // namespace

std::span<const ReaderKind> ImageReaders() { return kReaders; }

std::vector<ReaderKind> AllReaders() {
  std::vector<ReaderKind> all;
  for (const auto& some : {SetReaders(), CameraReaders(), SceneReaders(), ColmapReaders(),
                           CalibReaders(), WorkReaders(), ImageReaders()}) {
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

}  // namespace dtr::fuzz
