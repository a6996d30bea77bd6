#include "dtr/io/formats/foreign_depth.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>

#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/pfm.h"

namespace dtr::io {
namespace {

Grid<float> FloatsFromPng16(const std::filesystem::path& file, std::uint64_t limit_px) {
  const Grid<std::uint16_t> codes = ReadPng16(file, limit_px);
  Grid<float> numbers(codes.width(), codes.height());
  std::copy(codes.data().begin(), codes.data().end(), numbers.data().begin());
  return numbers;
}

Grid<float> ReadNumbers(const std::filesystem::path& file, std::uint64_t limit_px) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".exr" || extension == ".tif" || extension == ".tiff") {
    return ReadFloatGrid(file, limit_px);
  }
  if (extension == ".pfm") return ReadPfm(file);
  if (extension == ".png") return FloatsFromPng16(file, limit_px);
  throw UsageError(file.string() + ": expected a depth map as .exr, .pfm, .png or .tif, found \"" +
                   extension + "\"");
}

bool IsWholePart(int width, int height, int width_px, int height_px) {
  return width > 0 && width_px % width == 0 && height_px % height == 0 &&
         width_px / width == height_px / height;
}

}  // namespace

DepthImage ReadForeignDepth(const std::filesystem::path& file, DepthKind kind, double unit_scale,
                            int width_px, int height_px) {
  if (!(unit_scale > 0) || !std::isfinite(unit_scale)) {
    throw UsageError(file.string() + ": expected a positive depth unit, found " +
                     std::to_string(unit_scale));
  }
  const auto limit_px =
      static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px);
  const Grid<float> numbers = ReadNumbers(file, limit_px);
  if (numbers.channels() != 1) {
    throw Error(file.string() + ": expected a depth map of one channel, found " +
                std::to_string(numbers.channels()));
  }
  if (!IsWholePart(numbers.width(), numbers.height(), width_px, height_px)) {
    throw Error(file.string() + ": expected a depth map of " + std::to_string(width_px) + "x" +
                std::to_string(height_px) + " pixels or a whole part of it, found " +
                std::to_string(numbers.width()) + "x" + std::to_string(numbers.height()) +
                "; give the map of this image");
  }
  DepthImage depth(numbers.width(), numbers.height(), kind);
  for (size_t i = 0; i < numbers.data().size(); ++i) {
    const auto scaled = static_cast<float>(numbers.data()[i] * unit_scale);
    depth.grid().data()[i] = DepthImage::IsHole(scaled) ? 0.0f : scaled;
  }
  return depth;
}

}  // namespace dtr::io
