// dtr/io/code_bands.h -- internal to dtr/io: an image of 16-bit codes with holes, compressed
// without loss in bands of rows that decode apart from each other (docs/FORMAT.md, section 4.1).
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "dtr/types/grid.h"

namespace dtr::io {

/// The bytes of such a file: the same for any number of threads (0: all cores). Code 0 is a hole.
/// Throws Error unless the grid has one channel and pixels.
std::string EncodeBands(const Grid<std::uint16_t>& codes);

/// The inverse. The size that the image must have is checked, as are all sizes in the file,
/// before anything is allocated. Throws Error (without a file's name) for whatever EncodeBands
/// cannot have written: another size, missing or additional bytes, a checksum that does not hold.
Grid<std::uint16_t> DecodeBands(std::string_view bytes, int width_px, int height_px);

/// No file of that size is larger.
std::uint64_t MostBandBytes(int width_px, int height_px);

}  // namespace dtr::io
