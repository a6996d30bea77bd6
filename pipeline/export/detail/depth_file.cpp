#include "pipeline/export/detail/depth_file.h"

#include <cmath>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/npy.h"
#include "dtr/io/formats/pfm.h"

namespace dtr::pipeline {
namespace {

constexpr double kMostSteps = 65535;

}  // namespace

DepthPlanes PlanesOf(const SurfaceView& surface, DepthKind kind) {
  const int width = surface.inverse_depth.width(), height = surface.inverse_depth.height();
  DepthPlanes planes{DepthImage(width, height, kind), Grid<float>(width, height),
                     Mask(width, height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double w = surface.inverse_depth(x, y);
      if (!(w > 0)) continue;
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      const double length =
          kind == DepthKind::kRayDistance ? surface.camera.RayFromPixel(pixel).norm() : 1;
      const bool completed = surface.IsCompleted(x, y);
      planes.depth(x, y) = static_cast<float>(length / w);
      planes.sigma(x, y) =
          completed ? 0.0f : static_cast<float>(length * surface.SigmaAt(pixel) / (w * w));
      planes.validity(x, y) = completed ? DepthPlanes::kCompleted : DepthPlanes::kMeasured;
    }
  }
  return planes;
}

DepthImage OnImageGrid(const DepthImage& depth, int scale) {
  if (scale == 1) return depth;
  DepthImage wide(depth.width() * scale, depth.height() * scale, depth.kind());
  for (int y = 0; y < wide.height(); ++y) {
    for (int x = 0; x < wide.width(); ++x) wide(x, y) = depth(x / scale, y / scale);
  }
  return wide;
}

const char* ExtensionOf(DepthFileFormat format) {
  switch (format) {
    case DepthFileFormat::kExr:
      return ".exr";
    case DepthFileFormat::kPfm:
      return ".pfm";
    case DepthFileFormat::kPng16:
      return ".png";
    case DepthFileFormat::kNpy:
      return ".npy";
  }
  throw std::logic_error("ExtensionOf: unknown format");
}

DepthFileFormat FloatFormatOf(DepthFileFormat format) {
  return format == DepthFileFormat::kPng16 ? DepthFileFormat::kExr : format;
}

void WriteFloats(const std::filesystem::path& file, const Grid<float>& values,
                 DepthFileFormat format) {
  switch (format) {
    case DepthFileFormat::kExr:
      io::WriteExr(file, values);
      return;
    case DepthFileFormat::kPfm:
      io::WritePfm(file, values);
      return;
    case DepthFileFormat::kNpy:
      io::WriteNpy(file, values);
      return;
    case DepthFileFormat::kPng16:
      break;
  }
  throw std::invalid_argument("WriteFloats: PNG holds no floats");
}

double Png16Unit(LengthUnit unit, double max_depth) {
  constexpr double kMillimetre = 0.001;
  if (unit == LengthUnit::kMetre && max_depth <= kMostSteps * kMillimetre) return kMillimetre;
  if (!(max_depth > 0)) return kMillimetre;
  const double least = max_depth / kMostSteps;
  const double digit = std::pow(10.0, std::floor(std::log10(least)) - 1);
  return std::ceil(least / digit) * digit;
}

Grid<std::uint16_t> Png16Codes(const DepthImage& depth, double unit) {
  Grid<std::uint16_t> codes(depth.width(), depth.height());
  for (size_t i = 0; i < codes.data().size(); ++i) {
    const float value = depth.grid().data()[i];
    if (DepthImage::IsHole(value)) continue;
    const double code = std::max(1.0, std::round(value / unit));
    if (code > kMostSteps) {
      throw Error("depth " + std::to_string(value) + " is beyond 16 bits of " +
                  std::to_string(unit) + "; choose another depth format");
    }
    codes.data()[i] = static_cast<std::uint16_t>(code);
  }
  return codes;
}

}  // namespace dtr::pipeline
