// dtr/io/exr_checks.h -- internal to dtr/io: OpenEXR headers held against their file, since OpenEXR
// 3.1 allocates what a header claims before it reads.
#pragma once
#include <filesystem>

namespace dtr::io {

/// Throws Error for an EXR that is cut short in its headers, whose attributes are longer than the
/// file or not of their types' sizes, whose table of chunks would not fit into the file, or one
/// chunk of which would decode to more than a file of this size packs. Other files pass.
/// Source: "OpenEXR File Layout" (headers, attribute types, offset tables, compression methods).
void ExpectPlausibleExr(const std::filesystem::path& file);

}  // namespace dtr::io
