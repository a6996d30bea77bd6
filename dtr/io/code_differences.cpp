#include "dtr/io/code_differences.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "dtr/io/code_residuals.h"
#include "dtr/io/zstd_parts.h"

namespace dtr::io {
namespace {

constexpr char kDifferenceMagic[9] = "DTRDIFF1";
constexpr size_t kHashBytes = 32;
constexpr size_t kDifferenceParts = 4;
using DifferenceFrames = std::vector<std::string_view>;

/// What a band is stored as. Of `codes` the validity is a bit for each changed pixel, in their
/// order; residuals are those of changed pixels alone.
struct DifferenceParts {
  std::vector<std::uint8_t> changed;  ///< a bit a pixel, as the validity of CodeParts
  CodeParts codes;
};

std::string BytesOfHex(const std::string& hex) {
  if (hex.size() != 2 * kHashBytes) throw std::invalid_argument("expected a SHA-256 of 64 digits");
  std::string bytes;
  for (size_t i = 0; i < hex.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  }
  return bytes;
}

std::string HexOfBytes(std::string_view bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const char c : bytes) {
    const auto byte = static_cast<std::uint8_t>(c);
    hex += {kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return hex;
}

DifferenceParts SplitDifferences(const Grid<std::uint16_t>& codes, const Grid<std::uint16_t>& base,
                                 const BandRange& band) {
  const int width = codes.width();
  const size_t row_bytes = ValidityRowBytes(width);
  DifferenceParts parts;
  parts.changed.assign(row_bytes * static_cast<size_t>(band.rows), 0);
  int count = 0;
  PredictedSurface surface(width);
  for (int j = 0; j < band.rows; ++j) {
    const std::uint16_t* row = codes.row(band.first_row + j);
    const std::uint16_t* of_base = base.row(band.first_row + j);
    surface.BeginRow(j == 0);
    for (int x = 0; x < width; ++x) {
      const int predicted = surface.Prediction(x);
      surface.Put(x, row[x] == 0 ? predicted : row[x]);
      if (row[x] == of_base[x]) continue;
      SetBit(&parts.changed[row_bytes * static_cast<size_t>(j)], x);
      std::vector<std::uint8_t>& valid = parts.codes.validity;
      valid.resize(static_cast<size_t>(count) / 8 + 1, 0);
      if (row[x] != 0) {
        SetBit(valid.data(), count);
        AddResidual(row[x], predicted, parts.codes);
      }
      ++count;
    }
  }
  if (count == 0) parts.changed.clear();
  XorRows(parts.changed, width);
  return parts;
}

/// Rejects a band that says itself that it is none, before anything is allocated for it.
void ExpectPlausibleChanges(const DifferenceFrames& frames, int width_px, int rows) {
  const size_t bits = ValidityRowBytes(width_px) * static_cast<size_t>(rows);
  const size_t pixels = static_cast<size_t>(width_px) * static_cast<size_t>(rows);
  const auto changed = PartSizeOf(frames[0]), residuals = PartSizeOf(frames[2]);
  if (changed != 0 && changed != bits) {
    FailCoded("a part of " + std::to_string(bits) + " bytes or none", "another");
  }
  if (PartSizeOf(frames[1]) > (pixels + 7) / 8 || residuals > pixels ||
      PartSizeOf(frames[3]) > 2 * residuals) {
    FailCoded("parts of at most " + std::to_string(pixels) + " pixels", "more");
  }
}

DifferenceParts DecompressedChanges(const DifferenceFrames& frames, int width_px, int rows) {
  DifferenceParts parts;
  const size_t bits = ValidityRowBytes(width_px) * static_cast<size_t>(rows);
  parts.changed = DecompressedPart(frames[0], frames[0].empty() ? 0 : bits);
  XorRowsBack(parts.changed, width_px);
  const size_t changed = CountBits(parts.changed);
  CodeParts& codes = parts.codes;
  codes.validity = DecompressedPart(frames[1], (changed + 7) / 8);
  if (changed % 8 != 0 && codes.validity.back() >> (changed % 8) != 0) {
    FailCoded("0 beyond the changed pixels", "1");
  }
  codes.residuals = DecompressedPart(frames[2], CountBits(codes.validity));
  const auto wide = std::count(codes.residuals.begin(), codes.residuals.end(), kWide);
  codes.wide = DecompressedPart(frames[3], 2 * static_cast<size_t>(wide));
  return parts;
}

/// `codes` is the base. `parts` are consistent with each other: DecompressedChanges saw to it.
void ApplyChanges(const DifferenceParts& parts, const BandRange& band, Grid<std::uint16_t>& codes) {
  if (parts.changed.empty()) return;
  const int width = codes.width();
  const size_t row_bytes = ValidityRowBytes(width);
  ResidualReader residuals(parts.codes);
  PredictedSurface surface(width);
  int count = 0;
  for (int j = 0; j < band.rows; ++j) {
    std::uint16_t* row = codes.row(band.first_row + j);
    const std::uint8_t* changed = &parts.changed[row_bytes * static_cast<size_t>(j)];
    surface.BeginRow(j == 0);
    for (int x = 0; x < width; ++x) {
      const int predicted = surface.Prediction(x);
      if (BitAt(changed, x)) {
        row[x] = BitAt(parts.codes.validity.data(), count++) ? residuals.Next(predicted) : 0;
      }
      surface.Put(x, row[x] == 0 ? predicted : row[x]);
    }
  }
  residuals.ExpectNoHole();
}

}  // namespace

std::string EncodeDifferences(const Grid<std::uint16_t>& codes, const Grid<std::uint16_t>& base,
                              const std::string& base_sha256) {
  if (codes.empty() || codes.channels() != 1 || base.channels() != 1 ||
      base.width() != codes.width() || base.height() != codes.height()) {
    throw std::invalid_argument("coded differences: expected two images of one size");
  }
  const int bands = BandsOf(codes.height(), kRowsPerBand);
  std::vector<std::vector<std::string>> frames(static_cast<size_t>(bands));
  ParallelFor(0, bands, [&](int band) {
    const DifferenceParts parts =
        SplitDifferences(codes, base, RangeOfBand(band, kRowsPerBand, codes.height()));
    frames[static_cast<size_t>(band)] = {
        CompressedPart(parts.changed), CompressedPart(parts.codes.validity),
        CompressedPart(parts.codes.residuals), CompressedPart(parts.codes.wide)};
  });
  return kDifferenceMagic + BytesOfHex(base_sha256) + PackSize(codes.width(), codes.height()) +
         PackParts(frames);
}

std::string BaseOfDifferences(std::string_view bytes) {
  ExpectMagic(bytes, kDifferenceMagic);
  if (bytes.size() < kMagicBytes + kHashBytes) FailCoded("the SHA-256 of a base", "the end");
  return HexOfBytes(bytes.substr(kMagicBytes, kHashBytes));
}

Grid<std::uint16_t> DecodeDifferences(std::string_view bytes, const Grid<std::uint16_t>& base) {
  (void)BaseOfDifferences(bytes);  // magic and hash are there
  bytes.remove_prefix(kMagicBytes + kHashBytes);
  const int width_px = base.width(), height_px = base.height();
  const int rows_per_band = UnpackSize(bytes, width_px, height_px);
  const int bands = BandsOf(height_px, rows_per_band);
  const auto frames = UnpackParts(bytes, bands, kDifferenceParts);
  for (int band = 0; band < bands; ++band) {
    ExpectPlausibleChanges(frames[static_cast<size_t>(band)], width_px,
                           RangeOfBand(band, rows_per_band, height_px).rows);
  }
  Grid<std::uint16_t> codes = base;
  ParallelFor(0, bands, [&](int band) {
    const BandRange range = RangeOfBand(band, rows_per_band, height_px);
    ApplyChanges(DecompressedChanges(frames[static_cast<size_t>(band)], width_px, range.rows),
                 range, codes);
  });
  return codes;
}

std::uint64_t MostDifferenceBytes(int width_px, int height_px) {
  return kHashBytes + MostCodedBytes(width_px, height_px, kDifferenceParts);
}

}  // namespace dtr::io
