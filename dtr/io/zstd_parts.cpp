#include "dtr/io/zstd_parts.h"

#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>

#include "dtr/base/error.h"
#include "dtr/io/plain_bytes.h"

namespace dtr::io {
namespace {

constexpr size_t kSizeBytes = 3 * sizeof(std::uint32_t);
constexpr int kMaxRowsPerBand = 1 << 16;
constexpr int kLevel = 19;  // written once, read often; decoding is no slower for it

std::uint32_t U32At(std::string_view bytes, size_t at) {
  std::uint32_t value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

}  // namespace

void FailCoded(const std::string& expected, const std::string& found) {
  throw Error("coded depth: expected " + expected + ", found " + found +
              "; the file is damaged or cut short");
}

std::string CompressedPart(const PartBytes& part) {
  if (part.empty()) return "";
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(),
                                                                     &ZSTD_freeCCtx);
  if (!context) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::string out(ZSTD_compressBound(part.size()), '\0');
  const size_t size =
      ZSTD_compress2(context.get(), out.data(), out.size(), part.data(), part.size());
  if (ZSTD_isError(size)) throw Error(std::string("zstd: ") + ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

PartBytes DecompressedPart(std::string_view frame, size_t size) {
  if (size == 0) {
    if (!frame.empty()) FailCoded("no bytes for an empty part", std::to_string(frame.size()));
    return {};
  }
  const auto stated = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (stated != size) FailCoded("a part of " + std::to_string(size) + " bytes", "another");
  if (ZSTD_findFrameCompressedSize(frame.data(), frame.size()) != frame.size()) {
    FailCoded("one zstd frame", "part of one, or more");
  }
  PartBytes bytes(size);
  const size_t got = ZSTD_decompress(bytes.data(), size, frame.data(), frame.size());
  if (ZSTD_isError(got)) FailCoded("a zstd frame", ZSTD_getErrorName(got));
  if (got != size) FailCoded(std::to_string(size) + " bytes", std::to_string(got));
  return bytes;
}

unsigned long long PartSizeOf(std::string_view frame) {
  if (frame.empty()) return 0;
  const auto size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) {
    FailCoded("a zstd frame that says its size", "none");
  }
  // RFC 8878: a block holds at most 128 KiB and takes 4 bytes at least.
  constexpr unsigned long long kMaxPerByte = (128 << 10) / 4;
  if (size > kMaxPerByte * frame.size()) {
    FailCoded("a zstd frame of " + std::to_string(size) + " bytes",
              "one too short for them, of " + std::to_string(frame.size()));
  }
  return size;
}

std::string PackParts(const std::vector<std::vector<std::string>>& bands) {
  std::string out;
  for (const auto& parts : bands) {
    for (const std::string& part : parts) Append(out, static_cast<std::uint32_t>(part.size()));
  }
  for (const auto& parts : bands) {
    for (const std::string& part : parts) out += part;
  }
  return out;
}

std::vector<std::vector<std::string_view>> UnpackParts(std::string_view bytes, int bands,
                                                       size_t parts) {
  const size_t sizes = static_cast<size_t>(bands) * parts;
  if (bytes.size() / sizeof(std::uint32_t) < sizes) {
    FailCoded("the sizes of " + std::to_string(bands) + " bands", "the end");
  }
  std::uint64_t total = sizes * sizeof(std::uint32_t);
  for (size_t i = 0; i < sizes; ++i) total += U32At(bytes, i * sizeof(std::uint32_t));
  if (total != bytes.size()) {
    FailCoded(std::to_string(total) + " bytes", std::to_string(bytes.size()));
  }
  std::vector<std::vector<std::string_view>> unpacked(static_cast<size_t>(bands));
  size_t begin = sizes * sizeof(std::uint32_t), i = 0;
  for (auto& band : unpacked) {
    for (size_t part = 0; part < parts; ++part, ++i) {
      const size_t size = U32At(bytes, i * sizeof(std::uint32_t));
      band.push_back(bytes.substr(begin, size));
      begin += size;
    }
  }
  return unpacked;
}

int BandsOf(int height_px, int rows_per_band) {
  return (height_px + rows_per_band - 1) / rows_per_band;
}

BandRange RangeOfBand(int band, int rows_per_band, int height_px) {
  const int first = band * rows_per_band;
  return {first, std::min(rows_per_band, height_px - first)};
}

void ExpectMagic(std::string_view bytes, const char* magic) {
  if (bytes.substr(0, kMagicBytes) != magic) {
    FailCoded(std::string("the magic ") + magic, "another beginning");
  }
}

std::string PackSize(int width_px, int height_px) {
  std::string out;
  for (const int number : {width_px, height_px, kRowsPerBand}) {
    Append(out, static_cast<std::uint32_t>(number));
  }
  return out;
}

int UnpackSize(std::string_view& bytes, int width_px, int height_px) {
  if (bytes.size() < kSizeBytes) FailCoded("a size and the rows of a band", "the end");
  const std::uint32_t width = U32At(bytes, 0), height = U32At(bytes, 4), rows = U32At(bytes, 8);
  if (width != static_cast<std::uint32_t>(width_px) ||
      height != static_cast<std::uint32_t>(height_px)) {
    FailCoded(std::to_string(width_px) + "x" + std::to_string(height_px) + " pixels",
              std::to_string(width) + "x" + std::to_string(height));
  }
  if (rows == 0 || rows > kMaxRowsPerBand) {
    FailCoded("1 to 65536 rows a band", std::to_string(rows));
  }
  bytes.remove_prefix(kSizeBytes);
  return static_cast<int>(rows);
}

std::uint64_t MostCodedBytes(int width_px, int height_px, size_t parts) {
  // Bands of one row at worst; 64 bytes are more than zstd adds to what does not compress at all.
  constexpr std::uint64_t kFrameBytes = 64;
  const auto pixels = static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  return kMagicBytes + kSizeBytes + 4 * pixels + pixels / 64 +
         static_cast<std::uint64_t>(height_px) * parts * (sizeof(std::uint32_t) + kFrameBytes);
}

}  // namespace dtr::io
