#include "dtr/io/file_checks.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <string>

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
constexpr size_t kPngSignatureBytes = 8;
constexpr std::uint32_t kExrMagic = 20000630, kExrMultiPart = 0x1000;
constexpr size_t kLongestExrName = 255;  // OpenEXR's "long names"
// Deflate packs at most 1032 bytes into one (zlib's manual); of one bit a pixel those are 8256
// pixels. Images that small in memory need no such check.
constexpr std::uint64_t kMostPxPerByte = 8256, kAlwaysPlausiblePx = 4 << 20;

bool StartsAsPng(std::ifstream& in) {
  std::array<char, kPngSignatureBytes> start{};
  in.read(start.data(), start.size());
  return in.gcount() == static_cast<std::streamsize>(start.size()) &&
         std::string(start.data(), start.size()) == "\x89PNG\r\n\x1a\n";
}

// libpng stops after the last row, so a file that lost its end would pass; walk its chunks
// (PNG specification, section 5.3) up to IEND instead.
void ExpectPngEnd(const fs::path& file, std::ifstream& in, std::uintmax_t size) {
  std::uintmax_t at = kPngSignatureBytes;
  while (at + 12 <= size) {  // length, type and checksum are 4 bytes each
    std::array<unsigned char, 8> head{};
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) break;
    const std::uintmax_t length = (std::uintmax_t{head[0]} << 24) |
                                  (std::uintmax_t{head[1]} << 16) | (std::uintmax_t{head[2]} << 8) |
                                  head[3];
    at += 12 + length;
    if (std::string(head.begin() + 4, head.end()) == "IEND" && at <= size) return;
  }
  throw Error(file.string() + ": PNG cut short: expected chunks up to IEND, found " +
              std::to_string(size) + " bytes; copy the file again");
}

std::uint32_t ReadLittle32(std::ifstream& in) {
  std::array<unsigned char, 4> bytes{};
  in.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  return std::uint32_t{bytes[0]} | (std::uint32_t{bytes[1]} << 8) |
         (std::uint32_t{bytes[2]} << 16) | (std::uint32_t{bytes[3]} << 24);
}

// Up to a zero byte; what is longer than any name ends it as well, and is refused as a length.
std::string ReadName(std::ifstream& in) {
  std::string name;
  for (int c = in.get(); c > 0 && name.size() <= kLongestExrName; c = in.get()) {
    name += static_cast<char>(c);
  }
  return name;
}

// Bytes of the attribute types whose values have one size (OpenEXR file layout: "Predefined
// Attribute Types"); 0: any size. OpenEXR reads these without a look at the length that stands
// before them.
std::uint32_t BytesOfExrType(const std::string& type) {
  static const std::map<std::string, std::uint32_t> kBytes{
      {"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
      {"compression", 1}, {"double", 8},   {"envmap", 1},
      {"float", 4},       {"int", 4},      {"keycode", 28},
      {"lineOrder", 1},   {"m33f", 36},    {"m33d", 72},
      {"m44f", 64},       {"m44d", 128},   {"rational", 8},
      {"tiledesc", 9},    {"timecode", 8}, {"v2i", 8},
      {"v2f", 8},         {"v2d", 16},     {"v3i", 12},
      {"v3f", 12},        {"v3d", 24},     {"deepImageState", 1}};
  const auto found = kBytes.find(type);
  return found == kBytes.end() ? 0 : found->second;
}

// What the value itself says it takes: channels up to an empty name, a preview's pixels; else
// `length`.
std::uintmax_t ExrValueBytes(std::ifstream& in, const std::string& type, std::uint32_t length) {
  if (const std::uint32_t bytes = BytesOfExrType(type)) return bytes;
  const auto start = in.tellg();
  std::uintmax_t bytes = length;
  if (type == "chlist") {
    constexpr int kAfterName = 16;  // pixel type, linearity and reserved bytes, two sampling rates
    while (in && !ReadName(in).empty()) in.seekg(kAfterName, std::ios::cur);
    bytes = in ? static_cast<std::uintmax_t>(in.tellg() - start) : UINTMAX_MAX;
  } else if (type == "preview") {
    const std::uint64_t width = ReadLittle32(in), height = ReadLittle32(in);
    bytes = 8 + 4 * std::min<std::uint64_t>(width * height, UINT32_MAX);
  }
  in.clear();
  in.seekg(start);
  return bytes;
}

// OpenEXR 3.1 allocates what a header's attribute says it holds, up to 2 GiB, before it reads
// (OpenEXR file layout: "Header").
void ExpectExrAttributes(const fs::path& file, std::ifstream& in, std::uintmax_t size) {
  in.seekg(4);
  const bool several_parts = (ReadLittle32(in) & kExrMultiPart) != 0;
  while (in) {
    const std::string name = ReadName(in);
    if (!in) break;
    if (name.empty()) {
      if (!several_parts || in.peek() <= 0) return;  // the next part's header, or their end
      continue;
    }
    const std::string type = ReadName(in);
    const std::uint32_t length = ReadLittle32(in);
    if (!in) break;
    const std::uintmax_t left = size - static_cast<std::uintmax_t>(in.tellg());
    if (length > left || ExrValueBytes(in, type, length) != length) {
      throw Error(file.string() +
                  ": damaged EXR: expected attributes of their types' sizes within " +
                  std::to_string(size) + " bytes, found one of " + std::to_string(length) +
                  "; copy the file again");
    }
    in.seekg(static_cast<std::streamoff>(length), std::ios::cur);
  }
  throw Error(file.string() + ": EXR cut short: expected a whole header, found " +
              std::to_string(size) + " bytes; copy the file again");
}

}  // namespace

void ExpectWholeFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::uintmax_t size = fs::file_size(file);
  if (StartsAsPng(in)) {
    ExpectPngEnd(file, in, size);
    return;
  }
  in.clear();
  in.seekg(0);
  if (size >= 8 && ReadLittle32(in) == kExrMagic) ExpectExrAttributes(file, in, size);
}

void ExpectPlausibleSize(const fs::path& file, int width_px, int height_px) {
  const std::uint64_t found_px =
      static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  const std::uint64_t bytes = fs::file_size(file);
  if (found_px <= kAlwaysPlausiblePx || found_px / kMostPxPerByte <= bytes) return;
  throw Error(file.string() + ": damaged image: expected as many pixels as " +
              std::to_string(bytes) + " bytes can hold, found " + std::to_string(width_px) + "x" +
              std::to_string(height_px) + "; copy the file again");
}

}  // namespace dtr::io
