// dtr/io/code_differences.h -- internal to dtr/io: 16-bit codes with holes as differences to those
// of another image, the base, which cost almost nothing where the two are equal (docs/FORMAT.md,
// section 4.3).
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "dtr/types/grid.h"

namespace dtr::io {

/// The bytes of such a file: the same for any number of threads. Code 0 is a hole. `base_sha256`
/// (64 hexadecimal digits) names the file that `base`, of the same size, is read from.
std::string EncodeDifferences(const Grid<std::uint16_t>& codes, const Grid<std::uint16_t>& base,
                              const std::string& base_sha256);

/// The SHA-256 of the base that a file's codes are differences to. Throws Error where its beginning
/// is not that of such a file.
std::string BaseOfDifferences(std::string_view bytes);

/// The inverse; the image has the size of `base`. All sizes in the file are checked before anything
/// is allocated. Throws Error (without a file's name) for whatever EncodeDifferences cannot have
/// written against a base of this size. The caller compares BaseOfDifferences.
Grid<std::uint16_t> DecodeDifferences(std::string_view bytes, const Grid<std::uint16_t>& base);

/// No file of that size is larger.
std::uint64_t MostDifferenceBytes(int width_px, int height_px);

}  // namespace dtr::io
