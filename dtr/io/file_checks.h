// dtr/io/file_checks.h -- internal to dtr/io: what image libraries do not look at before they
// allocate or end early, looked at first.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

namespace dtr::io {

/// Throws Error for a file that begins like no format of photos (TGA, which has no such mark,
/// passes by its name). OpenImageIO would try every decoder it has on such a file, and some of them
/// allocate what they take for a size.
void ExpectImageKind(const std::filesystem::path& file);

/// Throws Error for a PNG that lacks its end and for an EXR that ExpectPlausibleExr rejects; other
/// files pass.
void ExpectWholeFile(const std::filesystem::path& file);

/// Throws Error for an image so large that a file of this size cannot hold it: header fields that
/// were made up, before anybody allocates for them. `format`: OpenImageIO's name; others than those
/// whose packing is known may pack as deflate does.
void ExpectPlausibleSize(const std::filesystem::path& file, std::uint64_t width_px,
                         std::uint64_t height_px, const std::string& format);

}  // namespace dtr::io
