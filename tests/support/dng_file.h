// tests/support/dng_file.h -- a small raw file (DNG 1.4) for tests.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "dtr/base/files.h"

namespace dtr::testing {

/// What a test's camera wrote.
struct DngSpec {
  int width_px = 128, height_px = 96;          ///< of the sensor, before the orientation
  std::array<double, 3> neutral{0.5, 1, 0.7};  ///< AsShotNeutral: grey in the sensor's values
  int orientation = 1;                         ///< EXIF's
  double focal_mm = 4.25;
  int focal_35mm = 26;
  /// Value of a sensor's pixel, 0 to 65535.
  std::function<int(int x, int y)> value = [](int, int) { return 20000; };
};

namespace dng_detail {

inline void Put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 255);
}

struct Entry {
  int tag, type, count;
  std::string bytes;
};

inline Entry Shorts(int tag, const std::vector<int>& values) {
  Entry entry{tag, 3, static_cast<int>(values.size()), {}};
  for (const int v : values) Put(entry.bytes, static_cast<std::uint64_t>(v), 2);
  return entry;
}
inline Entry Bytes(int tag, const std::vector<int>& values) {
  Entry entry{tag, 1, static_cast<int>(values.size()), {}};
  for (const int v : values) Put(entry.bytes, static_cast<std::uint64_t>(v), 1);
  return entry;
}
inline Entry Long(int tag, std::uint64_t value) {
  Entry entry{tag, 4, 1, {}};
  Put(entry.bytes, value, 4);
  return entry;
}
inline Entry Text(int tag, const std::string& text) {
  return {tag, 2, static_cast<int>(text.size() + 1), text + '\0'};
}
inline Entry Rationals(int tag, int type, const std::vector<double>& values) {
  constexpr int kUnit = 10000;
  Entry entry{tag, type, static_cast<int>(values.size()), {}};
  for (const double v : values) {
    Put(entry.bytes, static_cast<std::uint64_t>(std::lround(v * kUnit)), 4);
    Put(entry.bytes, kUnit, 4);
  }
  return entry;
}

// A directory at `at`, with what does not fit into its entries behind it.
inline std::string Directory(const std::vector<Entry>& entries, size_t at) {
  std::string head, more;
  const size_t behind = at + 2 + 12 * entries.size() + 4;
  Put(head, entries.size(), 2);
  for (const Entry& entry : entries) {
    Put(head, static_cast<std::uint64_t>(entry.tag), 2);
    Put(head, static_cast<std::uint64_t>(entry.type), 2);
    Put(head, static_cast<std::uint64_t>(entry.count), 4);
    if (entry.bytes.size() <= 4) {
      head += entry.bytes + std::string(4 - entry.bytes.size(), '\0');
    } else {
      Put(head, behind + more.size(), 4);
      more += entry.bytes + std::string(entry.bytes.size() % 2, '\0');
    }
  }
  Put(head, 0, 4);
  return head + more;
}

}  // namespace dng_detail

/// Writes it: a sensor of red, green, green, blue with sRGB's primaries, 16 bits, not packed (TIFF
/// 6.0 and Adobe's DNG specification 1.4).
inline void WriteDng(const std::filesystem::path& file, const DngSpec& spec) {
  using namespace dng_detail;
  std::string raw;
  for (int y = 0; y < spec.height_px; ++y) {
    for (int x = 0; x < spec.width_px; ++x) {
      Put(raw, static_cast<std::uint64_t>(spec.value(x, y)), 2);
    }
  }
  const auto entries = [&](size_t exif_at, size_t raw_at) {
    return std::vector<Entry>{
        Long(254, 0), Long(256, static_cast<std::uint64_t>(spec.width_px)),
        Long(257, static_cast<std::uint64_t>(spec.height_px)), Shorts(258, {16}), Shorts(259, {1}),
        Shorts(262, {32803}), Text(271, "Maker"), Text(272, "Model"), Long(273, raw_at),
        Shorts(274, {spec.orientation}), Shorts(277, {1}),
        Long(278, static_cast<std::uint64_t>(spec.height_px)), Long(279, raw.size()),
        Shorts(284, {1}), Shorts(33421, {2, 2}), Bytes(33422, {0, 1, 1, 2}), Long(34665, exif_at),
        Bytes(50706, {1, 4, 0, 0}), Bytes(50707, {1, 1, 0, 0}), Text(50708, "Maker Model"),
        Shorts(50714, {0}), Shorts(50717, {65535}),
        // XYZ to the sensor's values: sRGB's.
        Rationals(50721, 10,
                  {3.2405, -1.5371, -0.4985, -0.9693, 1.8760, 0.0416, 0.0556, -0.2040, 1.0572}),
        Rationals(50728, 5, {spec.neutral[0], spec.neutral[1], spec.neutral[2]}),
        Shorts(50778, {21})};
  };
  const std::vector<Entry> exif{Rationals(37386, 5, {spec.focal_mm}),
                                Shorts(41989, {spec.focal_35mm})};
  constexpr size_t kFirst = 8;
  const size_t exif_at = kFirst + Directory(entries(0, 0), kFirst).size();
  const std::string exif_bytes = Directory(exif, exif_at);
  const size_t raw_at = exif_at + exif_bytes.size();
  std::string content = "II";
  Put(content, 42, 2);
  Put(content, kFirst, 4);
  WriteFileAtomically(file,
                      content + Directory(entries(exif_at, raw_at), kFirst) + exif_bytes + raw);
}

}  // namespace dtr::testing
