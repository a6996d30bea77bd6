// dtr/io/formats/pfm.h -- portable float maps.
//
// "Pf" (1 channel) or "PF" (3), width, height and a scale as text, one blank, then float32 rows
// from the BOTTOM of the image to its top; a negative scale says little endian (P. Debevec's
// format, as Middlebury and MVSNet write it). The size of the scale says how to show the values
// (Middlebury: 1/255 of a disparity); programs do not multiply by it, and neither do we.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "dtr/types/grid.h"

namespace dtr::io {

/// Values as in the file, NaN and infinity too (Middlebury marks holes with infinity), top row
/// first. Throws Error when the header is damaged or the size does not fit the file exactly.
Grid<float> ReadPfm(const std::filesystem::path& file);

/// The same from the bytes of a file; `source` is what messages call it.
Grid<float> ParsePfm(std::string_view bytes, const std::string& source);

/// Writes 1 or 3 channels with scale -1 (little endian) or 1 (big endian); atomic. Throws Error
/// when the file cannot be written, std::invalid_argument for another number of channels.
void WritePfm(const std::filesystem::path& file, const Grid<float>& grid,
              bool little_endian = true);

}  // namespace dtr::io
