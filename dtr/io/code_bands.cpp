#include "dtr/io/code_bands.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/code_residuals.h"
#include "dtr/io/plain_bytes.h"

namespace dtr::io {
namespace {

using BandBytes = std::vector<std::uint8_t>;

constexpr char kBandMagic[9] = "DTRBAND1";
constexpr size_t kBandHeaderBytes = 8 + 3 * 4;
// Enough pixels for the entropy coder's tables to pay, few enough that photos have several bands.
constexpr int kRowsPerBand = 128;
constexpr int kMaxRowsPerBand = 1 << 16;
constexpr int kLevel = 19;  // written once, read often; decoding is no slower for it

/// Each part is a zstd frame with checksum, or nothing where empty.
using Parts = CodeParts;
constexpr size_t kParts = 3;
using PartSizes = std::array<std::uint32_t, kParts>;

struct BandRange {
  int first_row = 0, rows = 0;
};

[[noreturn]] void Fail(const std::string& expected, const std::string& found) {
  throw Error("coded depth: expected " + expected + ", found " + found +
              "; the file is damaged or cut short");
}

/// The inverse of folding 0, -1, 1, -2, ... to 0, 1, 2, 3, ...
int Unfolded(unsigned folded) {
  return static_cast<int>(folded >> 1) ^ -static_cast<int>(folded & 1);
}

std::string Compressed(const BandBytes& part) {
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

/// The frames of the band whose bytes begin with `bytes`.
std::array<std::string_view, kParts> FramesOf(std::string_view bytes, const PartSizes& sizes) {
  std::array<std::string_view, kParts> frames;
  size_t begin = 0;
  for (size_t part = 0; part < kParts; ++part) {
    frames[part] = bytes.substr(begin, sizes[part]);
    begin += sizes[part];
  }
  return frames;
}

/// Bytes that a frame says it holds.
unsigned long long ContentSize(std::string_view frame) {
  if (frame.empty()) return 0;
  const auto size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) {
    Fail("a zstd frame that says its size", "none");
  }
  // RFC 8878: a block holds at most 128 KiB and takes 4 bytes at least.
  constexpr unsigned long long kMaxPerByte = (128 << 10) / 4;
  if (size > kMaxPerByte * frame.size()) {
    Fail("a zstd frame of " + std::to_string(size) + " bytes",
         "one too short for them, of " + std::to_string(frame.size()));
  }
  return size;
}

/// Rejects a band that says itself that it is none, before anything is allocated for it.
void ExpectPlausible(const std::array<std::string_view, kParts>& frames, int width_px, int rows) {
  const size_t validity = ValidityRowBytes(width_px) * static_cast<size_t>(rows);
  const size_t pixels = static_cast<size_t>(width_px) * static_cast<size_t>(rows);
  const auto residuals = ContentSize(frames[1]);
  if (ContentSize(frames[0]) != validity) {
    Fail("a part of " + std::to_string(validity) + " bytes", "another");
  }
  if (residuals > pixels || ContentSize(frames[2]) > 2 * residuals) {
    Fail("parts of at most " + std::to_string(pixels) + " pixels", "more");
  }
}

/// Exactly `size` bytes out of exactly the bytes given.
BandBytes Decompressed(std::string_view frame, size_t size) {
  if (size == 0) {
    if (!frame.empty()) Fail("no bytes for an empty part", std::to_string(frame.size()));
    return {};
  }
  const auto told = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (told != size) Fail("a part of " + std::to_string(size) + " bytes", "another");
  if (ZSTD_findFrameCompressedSize(frame.data(), frame.size()) != frame.size()) {
    Fail("one zstd frame", "part of one, or more");
  }
  BandBytes bytes(size);
  const size_t got = ZSTD_decompress(bytes.data(), size, frame.data(), frame.size());
  if (ZSTD_isError(got)) Fail("a zstd frame", ZSTD_getErrorName(got));
  if (got != size) Fail(std::to_string(size) + " bytes", std::to_string(got));
  return bytes;
}

size_t CountValid(BandBytes& validity, int width_px) {
  const size_t row_bytes = ValidityRowBytes(width_px);
  for (size_t i = row_bytes; i < validity.size(); ++i) {
    validity[i] = static_cast<std::uint8_t>(validity[i] ^ validity[i - row_bytes]);
  }
  const int used_bits = (width_px - 1) % 8 + 1;
  const int padding = 255 & ~((1 << used_bits) - 1);
  size_t valid = 0;
  for (size_t i = 0; i < validity.size(); ++i) {
    if ((i + 1) % row_bytes == 0 && (validity[i] & padding) != 0) Fail("0 beyond a row", "1");
    valid += static_cast<size_t>(std::popcount(validity[i]));
  }
  return valid;
}

Parts DecompressedParts(const std::array<std::string_view, kParts>& frames, int width_px,
                        int rows) {
  Parts parts;
  parts.validity = Decompressed(frames[0], ValidityRowBytes(width_px) * static_cast<size_t>(rows));
  parts.residuals = Decompressed(frames[1], CountValid(parts.validity, width_px));
  const auto wide = std::count(parts.residuals.begin(), parts.residuals.end(), kWide);
  parts.wide = Decompressed(frames[2], 2 * static_cast<size_t>(wide));
  return parts;
}

/// `parts` are consistent with each other: DecompressedParts saw to it.
void Join(const Parts& parts, const BandRange& band, Grid<std::uint16_t>& codes) {
  const int width = codes.width();
  const size_t row_bytes = ValidityRowBytes(width);
  const std::uint8_t* residual = parts.residuals.data();
  const std::uint8_t* wide = parts.wide.data();
  bool zero = false;
  PredictedSurface surface(width);
  for (int j = 0; j < band.rows; ++j) {
    std::uint16_t* row = codes.row(band.first_row + j);
    const std::uint8_t* bits = &parts.validity[row_bytes * static_cast<size_t>(j)];
    surface.BeginRow(j == 0);
    for (int x = 0; x < width; ++x) {
      const int predicted = surface.Prediction(x);
      if ((bits[x / 8] >> (x % 8) & 1) == 0) {
        surface.Put(x, predicted);
        continue;
      }
      unsigned folded = *residual++;
      if (folded == kWide) {
        folded = wide[0] | static_cast<unsigned>(wide[1]) << 8;
        wide += 2;
      }
      const auto code = static_cast<std::uint16_t>(predicted + Unfolded(folded));
      zero |= code == 0;
      row[x] = code;
      surface.Put(x, code);
    }
  }
  if (zero) Fail("codes of at least 1 where there is depth", "0");
}

std::uint32_t U32At(std::string_view bytes, size_t at) {
  std::uint32_t value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

int BandsOf(int height_px, int rows_per_band) {
  return (height_px + rows_per_band - 1) / rows_per_band;
}

BandRange RangeOfBand(int band, int rows_per_band, int height_px) {
  const int first = band * rows_per_band;
  return {first, std::min(rows_per_band, height_px - first)};
}

}  // namespace

std::string EncodeBands(const Grid<std::uint16_t>& codes, int threads) {
  if (codes.empty() || codes.channels() != 1) {
    throw Error("coded depth: expected one channel of 16 bits to write");
  }
  const int bands = BandsOf(codes.height(), kRowsPerBand);
  std::vector<std::array<std::string, kParts>> frames(static_cast<size_t>(bands));
  ParallelFor(0, bands, threads, [&](int band) {
    const BandRange range = RangeOfBand(band, kRowsPerBand, codes.height());
    const Parts parts = SplitCodes(codes, range.first_row, range.rows);
    frames[static_cast<size_t>(band)] = {Compressed(parts.validity), Compressed(parts.residuals),
                                         Compressed(parts.wide)};
  });
  std::string out(kBandMagic, 8);
  for (const int number : {codes.width(), codes.height(), kRowsPerBand}) {
    Append(out, static_cast<std::uint32_t>(number));
  }
  for (const auto& band : frames) {
    for (const std::string& frame : band) Append(out, static_cast<std::uint32_t>(frame.size()));
  }
  for (const auto& band : frames) {
    for (const std::string& frame : band) out += frame;
  }
  return out;
}

Grid<std::uint16_t> DecodeBands(std::string_view bytes, int width_px, int height_px, int threads) {
  if (bytes.size() < kBandHeaderBytes || bytes.substr(0, 8) != std::string_view(kBandMagic, 8)) {
    Fail("the magic DTRBAND1 and a header", "another beginning");
  }
  const std::uint32_t width = U32At(bytes, 8), height = U32At(bytes, 12), rows = U32At(bytes, 16);
  if (width != static_cast<std::uint32_t>(width_px) ||
      height != static_cast<std::uint32_t>(height_px)) {
    Fail(std::to_string(width_px) + "x" + std::to_string(height_px) + " pixels",
         std::to_string(width) + "x" + std::to_string(height));
  }
  if (rows == 0 || rows > kMaxRowsPerBand) {
    Fail("1 to 65536 rows a band", std::to_string(rows));
  }
  const int rows_per_band = static_cast<int>(rows);
  const int bands = BandsOf(height_px, rows_per_band);
  const size_t table_bytes = static_cast<size_t>(bands) * sizeof(PartSizes);
  if (bytes.size() - kBandHeaderBytes < table_bytes) {
    Fail("the sizes of " + std::to_string(bands) + " bands", "the end");
  }
  std::vector<PartSizes> sizes(static_cast<size_t>(bands));
  std::memcpy(sizes.data(), bytes.data() + kBandHeaderBytes, table_bytes);
  std::vector<size_t> begins;
  size_t end = kBandHeaderBytes + table_bytes;
  for (const PartSizes& band : sizes) {
    begins.push_back(end);
    for (const std::uint32_t size : band) end += size;
  }
  if (end != bytes.size()) {
    Fail(std::to_string(end) + " bytes", std::to_string(bytes.size()));
  }
  const auto frames_of = [&](int band) {
    const auto i = static_cast<size_t>(band);
    return FramesOf(bytes.substr(begins[i]), sizes[i]);
  };
  for (int band = 0; band < bands; ++band) {
    ExpectPlausible(frames_of(band), width_px, RangeOfBand(band, rows_per_band, height_px).rows);
  }
  // What a header says of the first band may be a lie as well: it is decoded before all is taken.
  const Parts first =
      DecompressedParts(frames_of(0), width_px, RangeOfBand(0, rows_per_band, height_px).rows);
  Grid<std::uint16_t> codes(width_px, height_px);
  ParallelFor(0, bands, threads, [&](int band) {
    const BandRange range = RangeOfBand(band, rows_per_band, height_px);
    if (band == 0) {
      Join(first, range, codes);
    } else {
      Join(DecompressedParts(frames_of(band), width_px, range.rows), range, codes);
    }
  });
  return codes;
}

std::uint64_t MostBandBytes(int width_px, int height_px) {
  // Bands of one row at worst; 64 bytes are more than zstd adds to what does not compress at all.
  constexpr std::uint64_t kFrameBytes = 64;
  const auto pixels = static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  return kBandHeaderBytes + 4 * pixels + pixels / 64 +
         static_cast<std::uint64_t>(height_px) * (sizeof(PartSizes) + kParts * kFrameBytes);
}

}  // namespace dtr::io
