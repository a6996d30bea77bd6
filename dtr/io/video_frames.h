// dtr/io/video_frames.h -- images of a set that are frames of a video (docs/FORMAT.md,
// section 3.1).
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "dtr/types/grid.h"
#include "dtr/types/view.h"

namespace dtr::io {

/// No video of a set has more: to read one frame those before it are decoded.
inline constexpr int kMaxVideoFrames = 256;

/// Frame `number`, from 0, of a video of a set, decoded by FFmpeg's libraries: the same pixels
/// wherever it is read. `stored`: hash and size that the set records. Frames that are read one
/// after the other are decoded once each: decoders of late stay, within 256 MB. From any thread.
/// Throws Error where the file has another content, is no H.264 video of the kind that sets have,
/// has frames of another size or too few of them.
ImageRgb8 ReadVideoFrame(const std::filesystem::path& file, const StoredFile& stored, int number,
                         int width_px, int height_px);

/// 8-bit Y'CbCr of BT.709, full range, as three planes one after the other: what videos that are
/// not lossless contain. Every pixel has its own colour. There and back, no channel is off by more
/// than two levels, and greys not at all.
std::vector<std::uint8_t> YCbCrFromRgb(const ImageRgb8& image);
ImageRgb8 RgbFromYCbCr(std::span<const std::uint8_t* const, 3> planes,
                       std::span<const int, 3> row_bytes, int width_px, int height_px);

}  // namespace dtr::io
