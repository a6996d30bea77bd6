// dtr/base/files.h -- whole files in, whole files out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace dtr {

/// Content of a regular file. Throws Error when it cannot be read or is larger than `limit_bytes`.
std::string ReadFile(const std::filesystem::path& file, std::uintmax_t limit_bytes);

/// "x/" names the folder x: the path without separators at its end, so that a name can be appended.
std::filesystem::path WithoutTrailingSlash(const std::filesystem::path& path);

/// True for a pipe, a device or a socket, and for names of open files (/dev/stdout, /dev/fd, /proc):
/// what is written there goes to whoever reads it.
bool IsWrittenInPlace(const std::filesystem::path& file);

/// The path that a link leads to, link by link, also where nothing is there yet; any other path as
/// it is. Throws Error for links that lead in a circle.
std::filesystem::path ResolveLinks(const std::filesystem::path& path);

/// Writes `content` beside `file`, syncs it to disk and renames it over `file`: a reader sees the
/// old file or the new one, never a part. A link stays, and the file that it leads to is replaced;
/// what IsWrittenInPlace is opened and written. Throws Error and leaves no
/// temporary file on failure.
void WriteFileAtomically(const std::filesystem::path& file, std::string_view content);

/// Puts a file that was made elsewhere on the same disk under its name, in the place of one that is
/// there: synced, renamed, links as in WriteFileAtomically. Throws Error, also where `target` is
/// written in place.
void PublishFile(const std::filesystem::path& made, const std::filesystem::path& target);

}  // namespace dtr
