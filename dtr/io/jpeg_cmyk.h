// dtr/io/jpeg_cmyk.h -- internal to dtr/io: JPEGs of four inks that OpenImageIO takes for Adobe's.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>

#include "dtr/types/grid.h"

namespace dtr::io {

/// Adobe's programs store the amounts of ink inverted and say so by a marker (APP14, "Adobe").
/// Without it 0 is no ink. For a CMYK JPEG without the marker: its pixels as RGB, R = (255 - C)
/// (255 - K) / 255 and so on, no colour profile. Empty for any other JPEG. Throws Error when the
/// file is damaged.
std::optional<Grid<std::uint8_t>> ReadPlainCmykJpeg(const std::filesystem::path& file);

}  // namespace dtr::io
