// tests/capture/photo_files.h -- small photo files for tests.
#pragma once
#include <filesystem>
#include <string>

#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/io/image_io.h"
#include "dtr/types/grid.h"
#include "tests/support/message_of.h"

namespace dtr::capture::testing {

/// Noise, so that every pixel tells where it is.
inline ImageRgb8 NoisePhoto(int width_px, int height_px, std::uint64_t seed) {
  Random random(seed);
  ImageRgb8 image(width_px, height_px, 3);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(random.Index(256));
  return image;
}

/// Blocks of one colour: survives JPEG closely, and turning it is seen.
inline ImageRgb8 BlockPhoto(int width_px, int height_px, std::uint64_t seed) {
  ImageRgb8 image(width_px, height_px, 3);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = static_cast<std::uint8_t>(HashOf(seed, x / 8, y / 8, c) % 200 + 28);
      }
    }
  }
  return image;
}

/// Puts an EXIF block with only an orientation in front of a JPEG file's content (EXIF 2.3, 4.6.4:
/// APP1, "Exif", a little-endian TIFF header and one entry, tag 0x0112).
inline void AddExifOrientation(const std::filesystem::path& jpeg, int orientation) {
  std::string content = ReadFile(jpeg, 1 << 24);
  const std::string tiff = std::string("II*\0\x08\0\0\0", 8) + std::string("\x01\0", 2) +
                           std::string("\x12\x01\x03\0\x01\0\0\0", 8) +
                           static_cast<char>(orientation) + std::string("\0\0\0", 3) +
                           std::string("\0\0\0\0", 4);
  const std::string body = std::string("Exif\0\0", 6) + tiff;
  const size_t length = body.size() + 2;
  const std::string segment = std::string("\xff\xe1") + static_cast<char>(length >> 8) +
                              static_cast<char>(length & 255) + body;
  content.insert(2, segment);  // after the start-of-image marker
  WriteFileAtomically(jpeg, content);
}

using dtr::testing::MessageOf;

}  // namespace dtr::capture::testing
