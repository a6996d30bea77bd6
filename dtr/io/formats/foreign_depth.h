// dtr/io/formats/foreign_depth.h -- depth maps made by other programs.
#pragma once
#include <cstdint>
#include <filesystem>

#include "dtr/io/image_io.h"
#include "dtr/types/depth_image.h"

namespace dtr::io {

/// Reads a depth map, by the file's extension: .exr, .tif, .tiff (float or half: the channel Z,
/// else Y, else the first; a TIFF also of one channel of 16 bits), .pfm (one channel), .png (one
/// channel of 16 bits), .npy (one image of floats or integers: HxW, 1xHxW or HxWx1) or .depth
/// (Record3D's: LZFSE of floats, of the photo's shape).
/// Each number is multiplied by `unit_scale` to give scene units (0.001 for millimetres in a set in
/// metres) and measures what `kind` says; nothing guesses either. Numbers that are zero, negative,
/// NaN or infinite, before or after scaling, are holes (programs write 0, -1, NaN or infinity), as
/// is 65535 of 16 bits.
/// The map must be width_px x height_px or 1/s of it per axis with one whole s; its pixel (i, j)
/// then belongs to the image around s (i + 0.5), s (j + 0.5).
/// Throws Error for another size (checked before any pixel is read), a damaged file or another
/// coding; UsageError for another extension or a unit_scale that is not positive and finite.
DepthImage ReadForeignDepth(const std::filesystem::path& file, DepthKind kind, double unit_scale,
                            int width_px, int height_px);

/// The same for a map of any size up to 16 times the photo's pixels, and up to the limit.
DepthImage ReadDepthOfAnySize(const std::filesystem::path& file, DepthKind kind, double unit_scale,
                              int width_px, int height_px, std::uint64_t limit_px = kImageLimitPx);

/// Whether a depth map holds integers, whose unit is never a scene unit by itself: a PNG, or a TIFF
/// or .npy of such a type. Throws Error where that must be read from the file and cannot.
bool HoldsWholeNumbers(const std::filesystem::path& depth_file);

}  // namespace dtr::io
