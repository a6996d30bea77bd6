// dtr/io/stored_bytes.h -- images whose bytes are numbers and no colours.
#pragma once
#include <cstdint>
#include <filesystem>

#include "dtr/types/grid.h"

namespace dtr::io {

/// The first channel of an image of 8 bits, as stored: no profile and no gamma is applied. Throws
/// Error for another type, more than `limit_px` and a file that is damaged or cut short.
Grid<std::uint8_t> ReadStoredBytes(const std::filesystem::path& file, std::uint64_t limit_px);

}  // namespace dtr::io
