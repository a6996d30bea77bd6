// pipeline/export/detail/depth_file.h -- depth maps as other programs read them.
#pragma once
#include <filesystem>

#include "dtr/types/depth_image.h"
#include "pipeline/export/detail/surface_views.h"
#include "pipeline/export/export.h"

namespace dtr::pipeline {

/// What one file of depth holds, and what goes beside it; all of one size.
struct DepthPlanes {
  DepthImage depth;   ///< 0: no depth; says its kind
  Grid<float> sigma;  ///< standard deviation of that number, scene units; 0: not known
  Mask validity;      ///< kMeasured, kCompleted or 0
  static constexpr std::uint8_t kMeasured = 255, kCompleted = 128;
};

/// Of a view on the grid of its depth map.
DepthPlanes PlanesOf(const SurfaceView& surface, DepthKind kind);

/// Of the image's size, each depth pixel as often as the image has pixels of it (`scale` per axis):
/// readers would resize it in the same way.
DepthImage OnImageGrid(const DepthImage& depth, int scale);

/// ".exr", ".pfm", ".png", ".npy"; the format of floats beside it: of PNG that is EXR.
const char* ExtensionOf(DepthFileFormat format);
DepthFileFormat FloatFormatOf(DepthFileFormat format);

/// Writes floats; not for PNG. Throws Error.
void WriteFloats(const std::filesystem::path& file, const Grid<float>& values,
                 DepthFileFormat format);

/// The scene units that one step of 16 bits is where depths go up to `max_depth`: a millimetre in a
/// set in metres where that is enough, else the least of two digits that is.
double Png16Unit(LengthUnit unit, double max_depth);

/// Depth in whole units, rounded, 0 for holes; what is below one unit becomes one. Throws Error
/// for depths beyond 16 bits.
Grid<std::uint16_t> Png16Codes(const DepthImage& depth, double unit);

}  // namespace dtr::pipeline
