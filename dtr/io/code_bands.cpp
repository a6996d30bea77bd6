#include "dtr/io/code_bands.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/code_residuals.h"
#include "dtr/io/zstd_parts.h"

namespace dtr::io {
namespace {

constexpr char kBandMagic[9] = "DTRBAND1";
/// Each part is a zstd frame with checksum, or nothing where empty.
constexpr size_t kParts = 3;
using BandFrames = std::vector<std::string_view>;

/// Rejects a band that says itself that it is none, before anything is allocated for it.
void ExpectPlausible(const BandFrames& frames, int width_px, int rows) {
  const size_t validity = ValidityRowBytes(width_px) * static_cast<size_t>(rows);
  const size_t pixels = static_cast<size_t>(width_px) * static_cast<size_t>(rows);
  const auto residuals = PartSizeOf(frames[1]);
  if (PartSizeOf(frames[0]) != validity) {
    FailCoded("a part of " + std::to_string(validity) + " bytes", "another");
  }
  if (residuals > pixels || PartSizeOf(frames[2]) > 2 * residuals) {
    FailCoded("parts of at most " + std::to_string(pixels) + " pixels", "more");
  }
}

CodeParts DecompressedParts(const BandFrames& frames, int width_px, int rows) {
  CodeParts parts;
  parts.validity =
      DecompressedPart(frames[0], ValidityRowBytes(width_px) * static_cast<size_t>(rows));
  XorRowsBack(parts.validity, width_px);
  parts.residuals = DecompressedPart(frames[1], CountBits(parts.validity));
  const auto wide = std::count(parts.residuals.begin(), parts.residuals.end(), kWide);
  parts.wide = DecompressedPart(frames[2], 2 * static_cast<size_t>(wide));
  return parts;
}

/// `parts` are consistent with each other: DecompressedParts saw to it.
void Join(const CodeParts& parts, const BandRange& band, Grid<std::uint16_t>& codes) {
  const int width = codes.width();
  const size_t row_bytes = ValidityRowBytes(width);
  ResidualReader residuals(parts);
  PredictedSurface surface(width);
  for (int j = 0; j < band.rows; ++j) {
    std::uint16_t* row = codes.row(band.first_row + j);
    const std::uint8_t* bits = &parts.validity[row_bytes * static_cast<size_t>(j)];
    surface.BeginRow(j == 0);
    for (int x = 0; x < width; ++x) {
      const int predicted = surface.Prediction(x);
      if (!BitAt(bits, x)) {
        surface.Put(x, predicted);
        continue;
      }
      row[x] = residuals.Next(predicted);
      surface.Put(x, row[x]);
    }
  }
  residuals.ExpectNoHole();
}

}  // namespace

std::string EncodeBands(const Grid<std::uint16_t>& codes) {
  if (codes.empty() || codes.channels() != 1) {
    throw Error("coded depth: expected one channel of 16 bits to write");
  }
  const int bands = BandsOf(codes.height(), kRowsPerBand);
  std::vector<std::vector<std::string>> frames(static_cast<size_t>(bands));
  ParallelFor(0, bands, [&](int band) {
    const BandRange range = RangeOfBand(band, kRowsPerBand, codes.height());
    CodeParts parts = SplitCodes(codes, range.first_row, range.rows);
    frames[static_cast<size_t>(band)] = {CompressedPart(parts.validity),
                                         CompressedPart(parts.residuals),
                                         CompressedPart(parts.wide)};
  });
  return kBandMagic + PackSize(codes.width(), codes.height()) + PackParts(frames);
}

Grid<std::uint16_t> DecodeBands(std::string_view bytes, int width_px, int height_px) {
  ExpectMagic(bytes, kBandMagic);
  bytes.remove_prefix(kMagicBytes);
  const int rows_per_band = UnpackSize(bytes, width_px, height_px);
  const int bands = BandsOf(height_px, rows_per_band);
  const auto frames = UnpackParts(bytes, bands, kParts);
  for (int band = 0; band < bands; ++band) {
    ExpectPlausible(frames[static_cast<size_t>(band)], width_px,
                    RangeOfBand(band, rows_per_band, height_px).rows);
  }
  // What a header says of the first band may be a lie as well: it is decoded before all is taken.
  const CodeParts first =
      DecompressedParts(frames.front(), width_px, RangeOfBand(0, rows_per_band, height_px).rows);
  Grid<std::uint16_t> codes(width_px, height_px);
  ParallelFor(0, bands, [&](int band) {
    const BandRange range = RangeOfBand(band, rows_per_band, height_px);
    const BandFrames& of_band = frames[static_cast<size_t>(band)];
    Join(band == 0 ? first : DecompressedParts(of_band, width_px, range.rows), range, codes);
  });
  return codes;
}

std::uint64_t MostBandBytes(int width_px, int height_px) {
  return MostCodedBytes(width_px, height_px, kParts);
}

}  // namespace dtr::io
