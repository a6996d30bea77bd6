// tests/cli/web_page_bytes.h -- bytes and coded maps of a web page read back, as docs/EXPORT.md
// says.
#pragma once
#include <string>

#include "dtr/types/grid.h"

namespace dtr::testing {

/// What stands between two marks; nothing where the first is missing.
std::string Between(const std::string& text, const std::string& start, const std::string& end);

/// The bytes of a script element's text, `size` of them.
std::string BytesOfText(const std::string& text, size_t size);

/// A depth map's codes, 0 for holes.
Grid<std::uint16_t> DecodedMap(const std::string& places, const std::string& values, int columns,
                               int rows);

}  // namespace dtr::testing
