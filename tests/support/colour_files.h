// tests/support/colour_files.h -- files that state their colours in the ways of other programs.
#pragma once
#include <gtest/gtest.h>
#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/base/files.h"

namespace dtr::testing {

/// An ICC profile of these primaries (x, y of red, green, blue), with white D65 and a curve: gamma,
/// or sRGB's where that is 0.
inline std::string IccProfile(const std::array<double, 6>& xy, double gamma) {
  const cmsCIExyY white{0.3127, 0.3290, 1};
  const cmsCIExyYTRIPLE primaries{{xy[0], xy[1], 1}, {xy[2], xy[3], 1}, {xy[4], xy[5], 1}};
  const std::array<double, 5> srgb{2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  cmsToneCurve* curve = gamma == 0 ? cmsBuildParametricToneCurve(nullptr, 4, srgb.data())
                                   : cmsBuildGamma(nullptr, gamma);
  const std::array<cmsToneCurve*, 3> curves{curve, curve, curve};
  cmsHPROFILE profile = cmsCreateRGBProfile(&white, &primaries, curves.data());
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  cmsFreeToneCurve(curve);
  return bytes;
}

inline constexpr std::array<double, 6> kDisplayP3{0.680, 0.320, 0.265, 0.690, 0.150, 0.060};
inline constexpr std::array<double, 6> kAdobeRgb{0.64, 0.33, 0.21, 0.71, 0.15, 0.06};
inline constexpr std::array<double, 6> kSrgb{0.64, 0.33, 0.30, 0.60, 0.15, 0.06};

/// Big-endian, as PNG and HEIF store numbers.
inline std::string BigEndian(std::uint32_t value, int bytes = 4) {
  std::string text;
  for (int i = bytes; i-- > 0;) text += static_cast<char>((value >> (8 * i)) & 255);
  return text;
}

/// Puts a chunk behind a PNG's header, with its CRC-32 (PNG specification, annex D).
inline void InsertPngChunk(const std::filesystem::path& file, const std::string& type,
                           const std::string& content) {
  constexpr size_t kHeader = 8 + 25;
  std::string png = ReadFile(file, 1 << 24);
  std::uint32_t crc = 0xffffffff;
  for (const char c : type + content) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? 0xedb88320 ^ (crc >> 1) : crc >> 1;
  }
  png.insert(kHeader, BigEndian(static_cast<std::uint32_t>(content.size())) + type + content +
                          BigEndian(~crc));
  WriteFileAtomically(file, png);
}

/// A little-endian baseline TIFF (TIFF 6.0) of one strip.
struct TiffField {
  std::uint16_t tag;
  std::vector<std::uint32_t> values;  ///< SHORT
};

inline void WriteTiff(const std::filesystem::path& file, int width, int height,
                      std::vector<TiffField> fields, const std::string& pixels) {
  const auto little = [](std::uint32_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 255);
    return text;
  };
  const auto pixels_at = static_cast<std::uint32_t>(8);
  fields.push_back({256, {static_cast<std::uint32_t>(width)}});
  fields.push_back({257, {static_cast<std::uint32_t>(height)}});
  fields.push_back({259, {1}});
  fields.push_back({273, {pixels_at}});
  fields.push_back({278, {static_cast<std::uint32_t>(height)}});
  fields.push_back({279, {static_cast<std::uint32_t>(pixels.size())}});
  std::sort(fields.begin(), fields.end(),
            [](const TiffField& a, const TiffField& b) { return a.tag < b.tag; });
  std::string padded = pixels + (pixels.size() % 2 != 0 ? std::string(1, '\0') : "");
  const auto directory_at = static_cast<std::uint32_t>(8 + padded.size());
  auto extra_at = static_cast<std::uint32_t>(directory_at + 2 + 12 * fields.size() + 4);
  std::string directory = little(static_cast<std::uint32_t>(fields.size()), 2), extra;
  for (const TiffField& field : fields) {
    std::string values;
    for (const std::uint32_t value : field.values) values += little(value, 2);
    directory += little(field.tag, 2) + little(3, 2) +
                 little(static_cast<std::uint32_t>(field.values.size()), 4);
    if (values.size() <= 4) {
      values.resize(4, '\0');
      directory += values;
    } else {
      directory += little(extra_at, 4);
      extra += values;
      extra_at += static_cast<std::uint32_t>(values.size());
    }
  }
  WriteFileAtomically(file, "II*" + std::string(1, '\0') + little(directory_at, 4) + padded +
                                directory + little(0, 4) + extra);
}

}  // namespace dtr::testing
