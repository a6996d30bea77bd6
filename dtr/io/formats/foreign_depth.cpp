#include "dtr/io/formats/foreign_depth.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/size_text.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/lzfse.h"
#include "dtr/io/formats/npy.h"
#include "dtr/io/formats/pfm.h"
#include "dtr/io/image_io.h"

namespace dtr::io {
namespace {

/// What depth cameras write where they have measured nothing, or more than 16 bits can hold.
constexpr std::uint16_t kNoReading = 65535;

Grid<float> FloatsFromPng16(const std::filesystem::path& file, std::uint64_t limit_px) {
  const Grid<std::uint16_t> codes = ReadPng16(file, limit_px);
  Grid<float> numbers(codes.width(), codes.height());
  std::transform(codes.data().begin(), codes.data().end(), numbers.data().begin(),
                 [](std::uint16_t code) { return code == kNoReading ? 0.0f : code; });
  return numbers;
}

// numpy's arrays of one image: rows and columns, with or without an axis of length 1.
Grid<float> FloatsFromNpy(const std::filesystem::path& file, std::uint64_t limit_px) {
  const NpyArray array =
      ReadNpy(file, {.half = true, .integers = true, .any_value = true, .max_values = limit_px});
  std::vector<size_t> shape = array.shape;
  if (shape.size() == 3 && shape.back() == 1) shape.pop_back();
  if (shape.size() == 3 && shape.front() == 1) shape.erase(shape.begin());
  const auto is_side = [](size_t extent) { return extent >= 1 && extent <= kMaxImageSidePx; };
  if (shape.size() != 2 || !is_side(shape[0]) || !is_side(shape[1])) {
    throw Error(file.string() +
                ": expected an array of rows and columns (HxW, 1xHxW or HxWx1) for a depth map, "
                "found another shape");
  }
  Grid<float> numbers(static_cast<int>(shape[1]), static_cast<int>(shape[0]));
  std::transform(array.values.begin(), array.values.end(), numbers.data().begin(),
                 [](double value) { return static_cast<float>(value); });
  return numbers;
}

// Record3D's: floats of phones (little-endian), row by row. The map has the photo's shape, which is
// not in the file.
Grid<float> FloatsFromLzfse(const std::filesystem::path& file, std::uint64_t limit_px, int width_px,
                            int height_px) {
  static_assert(std::endian::native == std::endian::little);
  constexpr std::uintmax_t kFloat = sizeof(float);
  const std::string bytes = DecodeLzfse(ReadFile(file, 2 * kFloat * limit_px + (1 << 16)),
                                        kFloat * limit_px, file.string());
  const size_t count = bytes.size() / kFloat;
  const double aspect = static_cast<double>(width_px) / height_px;
  const auto width =
      static_cast<size_t>(std::lround(std::sqrt(aspect * static_cast<double>(count))));
  if (width == 0 || bytes.size() % kFloat != 0 || count % width != 0) {
    throw Error(file.string() + ": expected a depth map of the shape of its photo of " +
                SizeText(width_px, height_px) + ", found " + std::to_string(count) +
                " numbers; give the map of this photo");
  }
  Grid<float> numbers(static_cast<int>(width), static_cast<int>(count / width));
  std::memcpy(numbers.data().data(), bytes.data(), bytes.size());
  return numbers;
}

Grid<float> ReadNumbers(const std::filesystem::path& file, std::uint64_t limit_px, int width_px,
                        int height_px) {
  const std::string extension = LowerExtension(file);
  if (extension == ".depth") return FloatsFromLzfse(file, limit_px, width_px, height_px);
  if (extension == ".npy") return FloatsFromNpy(file, limit_px);
  if (extension == ".pfm") return ReadPfm(file);
  if (extension == ".png") return FloatsFromPng16(file, limit_px);
  if (extension == ".tif" || extension == ".tiff") {
    return HoldsWholeNumbers(file) ? FloatsFromPng16(file, limit_px)
                                   : ReadFloatGrid(file, limit_px);
  }
  if (extension == ".exr") return ReadFloatGrid(file, limit_px);
  throw UsageError(file.string() +
                   ": expected a depth map as .exr, .pfm, .png, .tif or .npy, found \"" +
                   extension + "\"");
}

bool IsWholePart(int width, int height, int width_px, int height_px) {
  return width > 0 && width_px % width == 0 && height_px % height == 0 &&
         width_px / width == height_px / height;
}

DepthImage Scaled(const std::filesystem::path& file, const Grid<float>& numbers, DepthKind kind,
                  double unit_scale) {
  DepthImage depth(numbers.width(), numbers.height(), kind);
  if (numbers.channels() != 1) {
    throw Error(file.string() + ": expected a depth map of one channel, found " +
                std::to_string(numbers.channels()));
  }
  for (size_t i = 0; i < numbers.data().size(); ++i) {
    const auto scaled = static_cast<float>(numbers.data()[i] * unit_scale);
    depth.grid().data()[i] = DepthImage::IsHole(scaled) ? 0.0f : scaled;
  }
  return depth;
}

void RequireUnit(const std::filesystem::path& file, double unit_scale) {
  if (unit_scale > 0 && std::isfinite(unit_scale)) return;
  throw UsageError(file.string() + ": expected a positive depth unit, found " +
                   std::to_string(unit_scale));
}

std::uint64_t PixelsOf(int width_px, int height_px) {
  return static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
}

}  // namespace

bool HoldsWholeNumbers(const std::filesystem::path& depth_file) {
  const std::string extension = LowerExtension(depth_file);
  if (extension == ".npy") return NpyHoldsWholeNumbers(depth_file);
  if (extension == ".tif" || extension == ".tiff") return !ReadImageHeader(depth_file).is_float;
  return extension == ".png";
}

DepthImage ReadForeignDepth(const std::filesystem::path& file, DepthKind kind, double unit_scale,
                            int width_px, int height_px) {
  RequireUnit(file, unit_scale);
  const Grid<float> numbers = ReadNumbers(file, PixelsOf(width_px, height_px), width_px, height_px);
  if (!IsWholePart(numbers.width(), numbers.height(), width_px, height_px)) {
    throw Error(file.string() + ": expected a depth map of " + std::to_string(width_px) + "x" +
                std::to_string(height_px) + " pixels or a whole part of it, found " +
                std::to_string(numbers.width()) + "x" + std::to_string(numbers.height()) +
                "; give the map of this image");
  }
  return Scaled(file, numbers, kind, unit_scale);
}

DepthImage ReadDepthOfAnySize(const std::filesystem::path& file, DepthKind kind, double unit_scale,
                              int width_px, int height_px, std::uint64_t limit_px) {
  constexpr std::uint64_t kMaxPerPixel = 16;  // four times finer than the photo per axis
  RequireUnit(file, unit_scale);
  const Grid<float> numbers = ReadNumbers(
      file, std::min(limit_px, kMaxPerPixel * PixelsOf(width_px, height_px)), width_px, height_px);
  return Scaled(file, numbers, kind, unit_scale);
}

}  // namespace dtr::io
