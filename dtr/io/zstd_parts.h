// dtr/io/zstd_parts.h -- internal to dtr/io: files of bands of rows, each band of several parts
// that zstd compressed (docs/FORMAT.md, sections 4.1 and 4.3).
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dtr::io {

using PartBytes = std::vector<std::uint8_t>;

/// Rejects the file: "coded depth: expected ..., found ...; the file is damaged or cut short".
[[noreturn]] void FailCoded(const std::string& expected, const std::string& found);

/// One zstd frame with checksum; nothing for nothing.
std::string CompressedPart(const PartBytes& part);
/// Exactly `size` bytes out of exactly the bytes given; FailCoded otherwise.
PartBytes DecompressedPart(std::string_view frame, size_t size);
/// Bytes that a frame says it holds, which the frame could: known before anything is allocated.
unsigned long long PartSizeOf(std::string_view frame);

/// The frames of the parts of each band, with their sizes in front.
std::string PackParts(const std::vector<std::vector<std::string>>& bands);
/// The inverse, of all of `bytes`; FailCoded where sizes do not fit.
std::vector<std::vector<std::string_view>> UnpackParts(std::string_view bytes, int bands,
                                                       size_t parts);

/// Rows of one band.
struct BandRange {
  int first_row = 0, rows = 0;
};
/// How an image is divided: bands of `rows_per_band` rows, the last one may have fewer.
int BandsOf(int height_px, int rows_per_band);
BandRange RangeOfBand(int band, int rows_per_band, int height_px);
/// Enough pixels for the entropy coder's tables to pay, few enough that photos have several bands.
inline constexpr int kRowsPerBand = 128;
inline constexpr size_t kMagicBytes = 8;

/// FailCoded unless a file begins with this magic of 8 characters.
void ExpectMagic(std::string_view bytes, const char* magic);
/// What stands in front of the parts: the size of the image and the rows of a band, u32 each.
std::string PackSize(int width_px, int height_px);
/// Takes it off `bytes` and returns the rows of a band. FailCoded unless the size is this one.
int UnpackSize(std::string_view& bytes, int width_px, int height_px);

/// No file of bands of so many parts, over an image of that size, is larger.
std::uint64_t MostCodedBytes(int width_px, int height_px, size_t parts);

}  // namespace dtr::io
