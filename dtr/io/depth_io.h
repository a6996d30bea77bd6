// dtr/io/depth_io.h -- depth maps and float planes on disk (docs/FORMAT.md, sections 4 and 5).
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "dtr/io/image_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/inverse_depth_code.h"

namespace dtr::io {

/// Reads one float channel of an EXR, float TIFF or other float image, shape (height, width):
/// the channel named Z, else Y, else the first. Values as in the file, including NaN, infinity and
/// negative ones: what they mean is for the importer to say. Throws Error for integer images.
Grid<float> ReadFloatGrid(const std::filesystem::path& file,
                          std::uint64_t limit_px = kImageLimitPx);

/// Writes one channel named Y, ZIP, float32 or half; deterministic bytes. With `half`, values that
/// half cannot hold (|v| > 65504) are rejected. Throws Error.
void WriteExr(const std::filesystem::path& file, const Grid<float>& grid, bool half = false,
              Mark mark = Mark::kNone);

/// Writes three channels named X, Y, Z, ZIP, float32; deterministic bytes. Throws Error.
void WriteExrOfVectors(const std::filesystem::path& file, const Grid<float>& grid,
                       Mark mark = Mark::kNone);

/// 16-bit grey PNG, values as stored. Throws Error when the file is not one channel of 16 bits.
Grid<std::uint16_t> ReadPng16(const std::filesystem::path& file,
                              std::uint64_t limit_px = kImageLimitPx);
void WritePng16(const std::filesystem::path& file, const Grid<std::uint16_t>& grid);

/// The file that another one is differences to (docs/FORMAT.md, section 4.3), and its content.
struct BaseFile {
  std::filesystem::path file;
  std::string sha256;
};

/// What the numbers in a depth file mean.
struct DepthFormat {
  DepthCoding coding = DepthCoding::kPng16InverseDepth;
  /// Every depth lies in this range, scene units; exr-half and png16-mm may round one past its end.
  double near_z = 0, far_z = 0;
  LengthUnit unit = LengthUnit::kUnknown;  ///< kPng16Millimetre needs kMetre
  int steps = InverseDepthCode::kSteps;    ///< of kZstdInverseDepth
};
/// Steps of inverse depth: `steps`, or 65534 where the coding has no other number of them.
int StepsOf(const DepthFormat& format);
/// Of the depth of a view in a set of that unit.
DepthFormat FormatOf(const View& view, LengthUnit unit);

/// Of its completed depth.
DepthFormat CompletedFormatOf(const View& view);
/// What names all depth of a view, completed depth included, in the file of its reduced mesh.
std::string DepthHashOf(const View& view);

/// "exr-float", "exr-half", "png16-mm", "png16-inverse", "zstd-inverse".
const char* NameOf(DepthCoding coding);
/// Inverse. Throws UsageError naming the known codings.
DepthCoding DepthCodingFromName(const std::string& name);
/// ".exr", ".png" or ".dtz".
const char* ExtensionOf(DepthCoding coding);

/// Inverse depth in n steps, 1 <= n <= 65534: code 0 a hole, c = 1..n + 1:
/// 1/z = 1/far + (c - 1)/n * (1/near - 1/far); c = n + 1 is exactly near, c = 1 exactly far.
/// |error of 1/z| is at most half a step of (1/near - 1/far)/n, and float32's rounding of z.
/// Throws Error unless 0 < near < far < infinity, every depth lies in [near, far] (compared as
/// float32) and every code is at most n + 1; the map must be plane z.
Grid<std::uint16_t> EncodeInverseDepth(const DepthImage& depth, double near_z, double far_z,
                                       int steps = InverseDepthCode::kSteps);
DepthImage DecodeInverseDepth(const Grid<std::uint16_t>& codes, double near_z, double far_z,
                              int steps = InverseDepthCode::kSteps);

/// The fewest steps with which every stored 1/z, read back as float32 z, is off by at most `error`
/// (1/scene unit). Throws Error where 65534 steps, or float32, are not that exact.
int StepsForError(double near_z, double far_z, double error);
/// Makes zstd-inverse the view's coding, with the fewest steps that keep every 1/z within `error`
/// (1/scene unit) of what it was before the view's depth was stored: what its coding now may have
/// rounded is taken off. Depths that other codings rounded past the ends of the range, by less than
/// their own error, are put at the ends. Throws Error as StepsForError.
void SetDepthError(View& view, double error);
/// The same where it can be done; false, and the view as it was, where 16 bits are not that exact.
bool TrySetDepthError(View& view, double error);
/// Puts the view's depths into [near, far], compared as float32, as codes of 1/z want them.
void ClampToRange(View& view);

/// 16-bit millimetres of a depth in metres: code 0 a hole. Throws Error for depths that round to
/// less than 1 mm or to more than 65.535 m.
Grid<std::uint16_t> EncodePng16Millimetre(const DepthImage& depth_m);
DepthImage DecodePng16Millimetre(const Grid<std::uint16_t>& codes);

/// The depth that reading back would give: `depth` rounded to what the coding can hold.
/// Throws Error where a depth does not fit the coding.
DepthImage RoundToCoding(const DepthImage& depth, const DepthFormat& format);

/// Smallest and largest depth of a map, for a view that has no range yet. A map of one depth gets
/// a range a thousandth wide; a map of holes only gets [1, 2].
struct DepthRangeOfMap {
  double near_z = 1, far_z = 2;
};
DepthRangeOfMap RangeOf(const DepthImage& depth);

/// Writes a plane-z map in its coding. Throws Error when a depth lies outside [near_z, far_z], is
/// NaN, infinite or negative, or does not fit the coding.
void WriteDepth(const std::filesystem::path& file, const DepthImage& depth,
                const DepthFormat& format);
/// Reads it back as plane z. `width_px`, `height_px`: the size it must have, checked before any
/// pixel is read. With a base (zstd-inverse only) the file is differences to it. Throws Error for
/// another size, a damaged file, another base or depths outside the range.
DepthImage ReadDepth(const std::filesystem::path& file, const DepthFormat& format, int width_px,
                     int height_px, const std::optional<BaseFile>& base = {});

/// Standard deviation of inverse depth, 1/scene unit, one number per depth pixel, 0 where depth is
/// a hole: float32 EXR whose numbers keep 8 significant bits (relative error at most 2^-8; a
/// standard deviation is never known better), which halves the file. Throws Error for negative or
/// not finite values.
void WriteSigma(const std::filesystem::path& file, const Grid<float>& inverse_depth_sigma);
/// With a base the file is differences of SigmaCodes to it.
Grid<float> ReadSigma(const std::filesystem::path& file, int width_px, int height_px,
                      const std::optional<BaseFile>& base = {});

/// The codes of a depth file, as EncodeInverseDepth gives them: png16-inverse or zstd-inverse,
/// whole by itself. Throws as ReadDepth.
Grid<std::uint16_t> ReadDepthCodes(const std::filesystem::path& file, const DepthFormat& format,
                                   int width_px, int height_px);
/// Sigmas as WriteSigma rounds them in 16 bits: the upper half of a float32 (bfloat16). Empty where
/// one has more bits than that.
std::optional<Grid<std::uint16_t>> SigmaCodes(const Grid<float>& inverse_depth_sigma);

}  // namespace dtr::io
