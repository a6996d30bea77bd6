// dtr/base/regular_file.h -- the one place that opens files to read them. A FIFO or a device in the
// place of a file would keep its reader waiting for ever, or never end.
#pragma once
#include <filesystem>
#include <fstream>

#include "dtr/base/open_file.h"

namespace dtr {

/// Throws Error unless `file` is a regular file that may be read; links are followed. For files
/// that a library opens.
void RequireRegularFile(const std::filesystem::path& file);

/// Opens it for system calls. Throws as RequireRegularFile, by what is open: another file may take
/// the name at any time.
OpenFile OpenToRead(const std::filesystem::path& file);

/// The same as a binary stream, at its beginning.
std::ifstream StreamOf(const std::filesystem::path& file);

}  // namespace dtr
