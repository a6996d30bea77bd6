#include "dtr/io/exr_checks.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
constexpr std::uint32_t kExrMagic = 20000630, kMultiPart = 0x1000;
constexpr size_t kLongestName = 255;  // OpenEXR's "long names"
// A chunk of up to this size needs no proof (some twenty times as much is allocated to read it); of
// a larger one each byte of the file stands for at most as many as deflate packs into one (zlib's
// manual).
constexpr std::uint64_t kAlwaysPlausibleBytes = 2 << 20, kMaxPacking = 1032;
constexpr std::uint64_t kOffsetBytes = 8;  // of a chunk, in the table after the headers

struct Reader {
  fs::path file;
  std::ifstream in;
  std::uintmax_t size = 0;

  std::uintmax_t Left() { return size - static_cast<std::uintmax_t>(in.tellg()); }
};

// What of a part's header decides how much is allocated for it.
struct Part {
  std::int64_t width = 1, height = 1;
  std::int64_t tile_width = 0, tile_height = 0;  // 0: scan lines
  std::int64_t lines = 16;                       // of a chunk of scan lines: ZIP's, as OpenEXR
                                                 // takes a header that names no compression
  std::uint64_t bytes_per_px = 0;
};

std::uint32_t ReadLittle32(std::ifstream& in) {
  std::array<unsigned char, 4> bytes{};
  in.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  return std::uint32_t{bytes[0]} | (std::uint32_t{bytes[1]} << 8) |
         (std::uint32_t{bytes[2]} << 16) | (std::uint32_t{bytes[3]} << 24);
}

std::int64_t ReadInt(std::ifstream& in) { return static_cast<std::int32_t>(ReadLittle32(in)); }

// Up to a zero byte; what is longer than any name ends it as well, and is rejected as a length.
std::string ReadName(std::ifstream& in) {
  std::string name;
  for (int c = in.get(); c > 0 && name.size() <= kLongestName; c = in.get()) {
    name += static_cast<char>(c);
  }
  return name;
}

// Bytes of the attribute types whose values have one size; 0: any size. OpenEXR reads these
// without a look at the length that stands before them.
std::uint32_t BytesOfType(const std::string& type) {
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

std::int64_t LinesOfChunk(int compression) {
  // none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB
  constexpr std::array<std::int64_t, 10> kLines{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
  const auto known = static_cast<size_t>(compression);
  return compression >= 0 && known < kLines.size() ? kLines[known] : 1;  // OpenEXR rejects others
}

// Channels up to an empty name; adds their bytes to `part`. UINTMAX_MAX: no end within the file.
std::uintmax_t ReadChannels(std::ifstream& in, Part* part) {
  constexpr std::uint32_t kHalf = 1;
  constexpr int kAfterType = 12;  // linearity and reserved bytes, two sampling rates
  const auto start = in.tellg();
  while (in && !ReadName(in).empty()) {
    part->bytes_per_px += ReadLittle32(in) == kHalf ? 2 : 4;
    in.seekg(kAfterType, std::ios::cur);
  }
  return in ? static_cast<std::uintmax_t>(in.tellg() - start) : UINTMAX_MAX;
}

// Takes from a value what `part` wants; returns the bytes that the value itself says it takes
// (channels up to an empty name, a preview's pixels), else `length`. Leaves the file at its start.
std::uintmax_t ReadValue(std::ifstream& in, const std::string& name, const std::string& type,
                         std::uint32_t length, Part* part) {
  const auto start = in.tellg();
  const std::uint32_t fixed = BytesOfType(type);
  std::uintmax_t bytes = fixed == 0 ? length : fixed;
  if (type == "chlist") {
    bytes = ReadChannels(in, part);
  } else if (type == "preview") {
    const std::uint64_t width = ReadLittle32(in), height = ReadLittle32(in);
    bytes = 8 + 4 * std::min<std::uint64_t>(width * height, UINT32_MAX);
  } else if (name == "dataWindow" && type == "box2i") {
    const std::int64_t left = ReadInt(in), top = ReadInt(in);
    part->width = ReadInt(in) - left + 1;
    part->height = ReadInt(in) - top + 1;
  } else if (name == "compression" && type == "compression") {
    part->lines = LinesOfChunk(in.get());
  } else if (name == "tiles" && type == "tiledesc") {
    part->tile_width = ReadLittle32(in);
    part->tile_height = ReadLittle32(in);
  }
  in.clear();
  in.seekg(start);
  return bytes;
}

std::uint64_t DivideUp(std::int64_t dividend, std::int64_t divisor) {
  return static_cast<std::uint64_t>((dividend + divisor - 1) / divisor);
}

void ExpectPlausiblePart(Reader& exr, const Part& part) {
  const bool tiled = part.tile_width > 0 && part.tile_height > 0;
  const std::string found = std::to_string(part.width) + "x" + std::to_string(part.height) +
                            " pixels" +
                            (tiled ? " in tiles of " + std::to_string(part.tile_width) + "x" +
                                         std::to_string(part.tile_height)
                                   : " in chunks of " + std::to_string(part.lines) + " lines") +
                            " of " + std::to_string(part.bytes_per_px) + " bytes a pixel";
  const auto reject = [&](const std::string& expected) {
    throw Error(exr.file.string() + ": damaged EXR: expected " + expected + " of " +
                std::to_string(exr.size) + " bytes, found " + found + "; copy the file again");
  };
  if (part.width <= 0 || part.height <= 0) reject("at least one pixel in a file");
  const std::int64_t chunk_width = tiled ? part.tile_width : part.width;
  const std::int64_t chunk_height = tiled ? part.tile_height : part.lines;
  const std::uint64_t across = DivideUp(part.width, chunk_width);
  const std::uint64_t down = DivideUp(part.height, chunk_height);  // each at most 2^32
  if (across > exr.size || down > exr.size || across * down > exr.Left() / kOffsetBytes) {
    reject("a table of chunks that fits into a file");
  }
  const std::uint64_t most = kAlwaysPlausibleBytes + kMaxPacking * exr.size;
  const auto most_px = most / std::max<std::uint64_t>(part.bytes_per_px, 1);
  const auto px_wide = static_cast<std::uint64_t>(chunk_width);
  if (static_cast<std::uint64_t>(chunk_height) > most_px / px_wide) {
    reject("chunks that can be packed into a file");
  }
}

// The file stands at an attribute's length. Returns after its value.
void ReadAttribute(Reader& exr, const std::string& name, const std::string& type, Part* part) {
  const std::uint32_t length = ReadLittle32(exr.in);
  if (!exr.in) return;
  if (length > exr.Left() || ReadValue(exr.in, name, type, length, part) != length) {
    throw Error(exr.file.string() +
                ": damaged EXR: expected attributes of their types' sizes within " +
                std::to_string(exr.size) + " bytes, found one of " + std::to_string(length) +
                "; copy the file again");
  }
  exr.in.seekg(static_cast<std::streamoff>(length), std::ios::cur);
}

// A header of this many bytes is followed by the pixels; several parts end with an empty header.
void ExpectPlausibleHeaders(Reader& exr) {
  const bool several_parts = (ReadLittle32(exr.in) & kMultiPart) != 0;
  Part part;
  while (exr.in) {
    const std::string name = ReadName(exr.in);
    if (!exr.in) break;
    if (!name.empty()) {
      const std::string type = ReadName(exr.in);
      ReadAttribute(exr, name, type, &part);
      continue;
    }
    ExpectPlausiblePart(exr, part);
    if (!several_parts || exr.in.peek() <= 0) return;  // the next part's header, or their end
    part = {};
  }
  throw Error(exr.file.string() + ": EXR cut short: expected a whole header, found " +
              std::to_string(exr.size) + " bytes; copy the file again");
}

}  // namespace

void ExpectPlausibleExr(const fs::path& file) {
  Reader exr{file, StreamOf(file), fs::file_size(file)};
  constexpr std::uintmax_t kMagicAndVersion = 8;
  if (exr.size >= kMagicAndVersion && ReadLittle32(exr.in) == kExrMagic)
    ExpectPlausibleHeaders(exr);
}

}  // namespace dtr::io
