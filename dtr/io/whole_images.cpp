#include "dtr/io/whole_images.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include "dtr/base/error.h"
#include "dtr/io/file_boxes.h"
#include "dtr/io/heif_items.h"

namespace dtr::io {
namespace {

// Measured with OpenImageIO 2.4 (docs/SECURITY.md); JPEG and JPEG 2000: of each channel.
constexpr double kBmpBytes = 2, kGifBytes = 8, kWebpBytes = 16, kHeifBytes = 16, kJpeg2000Bytes = 7,
                 kJpegBytes = 2;

constexpr int kMaxSegments = 10'000;  // of a JPEG before its pixels
constexpr int kMaxCanvases = 100;     // photos have one, and one of their depth

std::uint64_t Little(std::string_view bytes, size_t at, size_t count) {
  std::uint64_t value = 0;
  for (size_t i = count; i-- > 0 && at + i < bytes.size();) {
    value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  }
  return value;
}

std::optional<WholeImage> LookAtGif(FileBytes& file) {
  const std::string head = file.At(0, 10);
  if (!head.starts_with("GIF8")) return {};
  return WholeImage{Little(head, 6, 2), Little(head, 8, 2), kGifBytes, ""};
}

// One that is packed in runs; the height is negative where rows run from the top.
std::optional<WholeImage> LookAtBmp(FileBytes& file) {
  const std::string head = file.At(0, 34);
  constexpr std::uint64_t kRuns8 = 1, kRuns4 = 2;
  const std::uint64_t packing = Little(head, 30, 4);
  if (!head.starts_with("BM") || (packing != kRuns8 && packing != kRuns4)) return {};
  const auto side = [&](size_t at) {
    const auto px = static_cast<std::int32_t>(Little(head, at, 4));
    return static_cast<std::uint64_t>(std::abs(std::int64_t{px}));
  };
  return WholeImage{side(18), side(22), kBmpBytes, ""};
}

// The first chunk says it: VP8X the canvas, VP8L and VP8 the only image (RFC 9649, 2).
std::optional<WholeImage> LookAtWebp(FileBytes& file) {
  const std::string head = file.At(0, std::min<std::uint64_t>(30, file.size()));
  if (head.size() < 25 || !head.starts_with("RIFF") || head.compare(8, 4, "WEBP") != 0) return {};
  const std::string chunk = head.substr(12, 4);
  if (chunk == "VP8X") {
    return WholeImage{Little(head, 24, 3) + 1, Little(head, 27, 3) + 1, kWebpBytes, ""};
  }
  constexpr std::uint64_t k14Bits = 0x3fff;
  if (chunk == "VP8L") {
    const std::uint64_t bits = Little(head, 21, 4);
    return WholeImage{(bits & k14Bits) + 1, (bits >> 14 & k14Bits) + 1, kWebpBytes, ""};
  }
  if (chunk != "VP8 ") return {};
  return WholeImage{Little(head, 26, 2) & k14Bits, Little(head, 28, 2) & k14Bits, kWebpBytes, ""};
}

// What an image of others' is drawn on (ISO 23008-12, 6.6.2): a grid, or an overlay.
WholeImage CanvasOf(const HeifItem& item, const std::string& payload) {
  const size_t bytes = (Big(payload, 1, 1) & 1) != 0 ? 4 : 2;
  const size_t at = item.type == "grid" ? 4 : 10;  // after rows and columns, or the background
  return {Big(payload, at, bytes), Big(payload, at + bytes, bytes), kHeifBytes, ""};
}

std::optional<WholeImage> LookAtHeif(const std::filesystem::path& path) {
  HeifItems heif(path);
  std::optional<WholeImage> largest;
  const auto take = [&largest](const WholeImage& image) {
    if (!largest || image.bytes() > largest->bytes()) largest = image;
  };
  for (const std::string& extents : heif.Properties("ispe")) {
    take({Big(extents, 0, 4), Big(extents, 4, 4), kHeifBytes, ""});
  }
  int canvases = 0;
  for (const HeifItem& item : heif.items()) {
    if (item.type != "grid" && item.type != "iovl") continue;
    if (++canvases > kMaxCanvases) {
      throw Error(path.string() + ": damaged image: expected at most " +
                  std::to_string(kMaxCanvases) + " images that consist of others, found more");
    }
    take(CanvasOf(item, heif.BytesOf(item)));
  }
  return largest;
}

// The SIZ marker follows the start of the codestream (ISO 15444-1, A.5.1).
std::optional<WholeImage> LookAtCodestream(FileBytes& file, std::uint64_t at) {
  const std::string head = file.At(at, 42);
  if (!head.starts_with("\xff\x4f\xff\x51")) return {};
  const auto side = [&](size_t end, size_t begin) {
    return std::max(Big(head, end, 4), Big(head, begin, 4)) - Big(head, begin, 4);
  };
  return WholeImage{side(8, 16), side(12, 20),
                    kJpeg2000Bytes * static_cast<double>(Big(head, 40, 2)), ""};
}

std::optional<WholeImage> LookAtJpeg2000(FileBytes& file) {
  if (const auto bare = LookAtCodestream(file, 0)) return bare;
  if (file.At(4, 4) != "jP  ") return {};
  const auto boxes = BoxesIn(file, 0, file.size());
  const Box* codestream = FindBox(boxes, "jp2c");
  return codestream == nullptr ? std::nullopt : LookAtCodestream(file, codestream->begin);
}

// What a JPEG's segments say up to the first scan (ITU-T T.81, B.2).
struct JpegFrame {
  std::uint64_t width = 0, height = 0, channels = 0, channels_in_scan = 0;
  bool progressive = false;
};

// The segment at `at`; moves there behind it. False at the first scan, and where the file ends.
bool ReadSegment(FileBytes& file, std::uint64_t& at, JpegFrame& frame) {
  constexpr std::uint64_t kMark = 0xff, kScan = 0xda;
  const std::string head = file.At(at, std::min<std::uint64_t>(10, file.size() - at));
  if (head.size() < 5) return false;
  const std::uint64_t marker = Big(head, 1, 1);
  if (Big(head, 0, 1) != kMark || marker == kMark) {
    ++at;  // libjpeg goes on to the next marker, too
    return true;
  }
  if (marker == kScan) {
    frame.channels_in_scan = Big(head, 4, 1);
    return false;
  }
  // C0 to CF but for tables (C4), an extension (C8) and arithmetic coding's conditions (CC).
  if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc) {
    frame = {Big(head, 7, 2), Big(head, 5, 2), Big(head, 9, 1), 0, marker % 4 == 2};
  }
  const bool alone = marker <= 1 || (marker >= 0xd0 && marker <= 0xd8);
  at += alone ? 2 : 2 + std::max<std::uint64_t>(2, Big(head, 2, 2));
  return at < file.size();
}

// Of an image with several scans libjpeg holds all coefficients, as soon as it is opened.
std::optional<WholeImage> LookAtJpeg(const std::filesystem::path& path, FileBytes& file) {
  if (file.At(0, 2) != "\xff\xd8") return {};
  JpegFrame frame;
  std::uint64_t at = 2;
  int segments = 0;
  while (ReadSegment(file, at, frame)) {
    if (++segments <= kMaxSegments) continue;
    throw Error(path.string() + ": damaged image: expected its pixels within " +
                std::to_string(kMaxSegments) + " segments, found none; copy the file again");
  }
  if (!frame.progressive && frame.channels_in_scan >= frame.channels) return {};
  return WholeImage{frame.width, frame.height, kJpegBytes * static_cast<double>(frame.channels),
                    "jpeg"};
}

}  // namespace

std::optional<WholeImage> LookAtWholeImage(const std::filesystem::path& path) {
  if (IsHeif(path)) return LookAtHeif(path);
  FileBytes file(path);
  if (const auto image = LookAtJpeg(path, file)) return image;
  for (const auto look : {LookAtBmp, LookAtGif, LookAtWebp, LookAtJpeg2000}) {
    if (const auto image = look(file)) return image;
  }
  return {};
}

}  // namespace dtr::io
