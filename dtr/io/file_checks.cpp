#include "dtr/io/file_checks.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/regular_file.h"
#include "dtr/io/exr_checks.h"
#include "dtr/io/image_io.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
constexpr size_t kPngSignatureBytes = 8;
// Images of so few pixels are small in memory whatever their files hold.
constexpr std::uint64_t kAlwaysPlausiblePx = 4 << 20;

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

bool StartsWith(const std::string& text, const char* start) {
  return text.compare(0, std::string(start).size(), start) == 0;
}

// By the first bytes that each format's specification gives; raw files of cameras are TIFFs or
// have a mark of their own.
bool IsImageStart(const std::string& start) {
  for (const char* mark :
       {"\x89PNG\r\n\x1a\n", "\xff\xd8\xff", "v/1\x01", "BM", "#?", "GIF8", "\xff\x4f\xff\x51",
        "8BPS", "SDPX", "XPDS", "FUJIFILM", "IIRO", "IIRS", "IIU", "MMOR", "II*", "II+", "FOVb"}) {
    if (StartsWith(start, mark)) return true;
  }
  const auto holds = [&](size_t at, const std::string& mark) {
    return start.compare(at, mark.size(), mark) == 0;
  };
  if (holds(0, std::string("MM\0", 3)) && start.size() > 3)
    return start[3] == '*' || start[3] == '+';
  if (start.size() > 2 && start[0] == 'P') {  // Netpbm, and PFM after it
    return std::string("123456fF").find(start[1]) != std::string::npos;
  }
  if (start.size() < 12) return false;
  return holds(4, "ftyp") || (holds(0, "RIFF") && holds(8, "WEBP")) ||
         holds(0, std::string("\0\0\0\x0cjP  ", 8));
}

// Bits of a PNG's pixel, from its header (PNG specification, section 11.2.2).
std::uint64_t PngBits(const fs::path& file) {
  std::ifstream in = StreamOf(file);
  std::array<char, 26> head{};
  if (!in.read(head.data(), head.size())) return 1;
  constexpr std::array<std::uint64_t, 7> kChannels{1, 1, 3, 1, 2, 1, 4};  // by colour type
  const auto type = static_cast<unsigned char>(head[25]);
  const auto depth = static_cast<unsigned char>(head[24]);
  return std::max(1, depth * static_cast<int>(type < kChannels.size() ? kChannels[type] : 1));
}

// The most pixels that a byte of a file can stand for. `format`: as OpenImageIO calls it.
std::uint64_t MaxPxPerByte(const fs::path& file, const std::string& format) {
  // Deflate packs at most 1032 bytes into one (zlib's manual): of one bit a pixel 8256 pixels.
  constexpr std::uint64_t kBits = 8, kDeflate = 1032;
  if (format == "png") return std::max<std::uint64_t>(1, kDeflate * kBits / PngBits(file));
  // A block of 8x8 pixels takes a bit of its brightness at least.
  if (format == "jpeg") return 64 * kBits;
  if (format == "hdr") return 16;     // runs of at most 127 of each of four channels, in two bytes
  if (format == "pnm") return kBits;  // not packed
  // Runs of at most 128 bytes, in two of them; sensors' numbers pack less.
  if (format == "targa" || format == "psd" || format == "dpx" || format == "raw") return 64 * kBits;
  return kDeflate * kBits;
}

// For a message: what is not printable as a full stop.
std::string Printable(std::string text) {
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '.';
  }
  return text;
}

}  // namespace

void ExpectImageKind(const fs::path& file) {
  if (LowerExtension(file) == ".tga") return;  // the one format that begins with no mark
  std::ifstream in = StreamOf(file);
  std::array<char, 12> bytes{};
  in.read(bytes.data(), bytes.size());
  const std::string start(bytes.data(), static_cast<size_t>(in.gcount()));
  if (IsImageStart(start)) return;
  throw Error(file.string() +
              ": no readable image: expected a PNG, JPEG, TIFF, OpenEXR or another format of "
              "photos, found a file that begins with \"" +
              Printable(start) + "\"; copy the file again or name an image");
}

// Only marks of which no other kind of file begins by chance.
bool HoldsPhoto(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return false;
  std::ifstream in = StreamOf(file);
  std::array<char, 12> bytes{};
  in.read(bytes.data(), bytes.size());
  const std::string start(bytes.data(), static_cast<size_t>(in.gcount()));
  if (start.size() < bytes.size()) return false;
  for (const std::string& mark :
       {std::string("\x89PNG\r\n\x1a\n"), std::string("\xff\xd8\xff"), std::string("II*\0", 4),
        std::string("MM\0*", 4), std::string("v/1\x01")}) {
    if (start.compare(0, mark.size(), mark) == 0) return true;
  }
  if (StartsWith(start, "RIFF")) return start.compare(8, 4, "WEBP") == 0;
  if (start.compare(4, 4, "ftyp") != 0) return false;
  for (const char* brand : {"heic", "heix", "heif", "heim", "heis", "mif1", "msf1", "avif"}) {
    if (start.compare(8, 4, brand) == 0) return true;
  }
  return false;
}

void ExpectWholeFile(const fs::path& file) {
  std::ifstream in = StreamOf(file);
  if (StartsAsPng(in)) {
    ExpectPngEnd(file, in, fs::file_size(file));
    return;
  }
  ExpectPlausibleExr(file);
}

void ExpectPlausibleSize(const fs::path& file, std::uint64_t width_px, std::uint64_t height_px,
                         const std::string& format) {
  if (height_px == 0 || width_px <= kAlwaysPlausiblePx / height_px) return;
  const std::uint64_t bytes = fs::file_size(file);
  if (width_px <= bytes * MaxPxPerByte(file, format) / height_px) return;
  throw Error(file.string() + ": damaged image: expected as many pixels as " +
              std::to_string(bytes) + " bytes can hold, found " + std::to_string(width_px) + "x" +
              std::to_string(height_px) + "; copy the file again");
}

}  // namespace dtr::io
