// dtr/io/formats/lzfse.h -- bytes that phones of Apple compress. Needs the standard library only.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace dtr::io {

/// The bytes that an LZFSE stream stands for: all of its blocks, of any kind (stored `bvx-`, LZVN
/// `bvxn`, entropy-coded `bvx1` and `bvx2`), to the end mark `bvx$`. What follows the mark is
/// ignored. `source` begins messages. Throws Error where the stream is cut short, damaged or stands
/// for more than `max_bytes`; no memory beyond these and some kB is allocated.
/// Format: https://github.com/lzfse/lzfse.
std::string DecodeLzfse(std::string_view stream, size_t max_bytes, const std::string& source);

}  // namespace dtr::io
