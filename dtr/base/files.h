// dtr/base/files.h -- whole files in, whole files out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace dtr {

/// Content of a file. Throws Error when it cannot be read or is larger than `limit_bytes`.
std::string ReadFile(const std::filesystem::path& file, std::uintmax_t limit_bytes);

/// "x/" names the folder x: the path without separators at its end, so that a name can be appended.
std::filesystem::path WithoutTrailingSlash(const std::filesystem::path& path);

/// Writes `content` beside `file`, syncs it to disk and renames it over `file`: a reader sees the
/// old file or the new one, never a part. Throws Error and leaves no temporary file on failure.
void WriteFileAtomically(const std::filesystem::path& file, std::string_view content);

}  // namespace dtr
