#include "dtr/base/files.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <tuple>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/open_file.h"

namespace dtr {
namespace fs = std::filesystem;

std::string ReadFile(const fs::path& file, std::uintmax_t limit_bytes) {
  std::error_code error;
  std::ignore = fs::file_size(file, error);  // says why, and rejects folders, which open
  if (error) throw Error(file.string() + ": cannot be read: " + error.message());
  // The size of what is open: another file may take the name at any time.
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const auto end = static_cast<std::streamoff>(in.tellg());
  if (!in || end < 0) throw Error(file.string() + ": cannot be read");
  const auto size = static_cast<std::uintmax_t>(end);
  if (size > limit_bytes) {
    throw Error(file.string() + ": expected at most " + std::to_string(limit_bytes) +
                " bytes, found " + std::to_string(size));
  }
  std::string content(size, '\0');
  in.seekg(0);
  errno = 0;
  if (!in.read(content.data(), static_cast<std::streamsize>(size))) {
    throw Error(file.string() + ": expected " + std::to_string(size) + " bytes, found " +
                std::to_string(in.gcount()) + " that can be read" +
                (errno != 0 ? std::string(": ") + std::strerror(errno) : "") +
                "; read it again once nothing writes it, or copy it again");
  }
  return content;
}

fs::path WithoutTrailingSlash(const fs::path& path) {
  return path.has_filename() || !path.has_relative_path() ? path : path.parent_path();
}

void WriteFileAtomically(const fs::path& file, std::string_view content) {
  const fs::path temporary = TemporaryFor(file);
  try {
    {
      const OpenFile out(temporary, O_WRONLY | O_CREAT | O_TRUNC, 0644);
      WriteAll(out, content);
      Done(fsync(out.fd()));
    }
    Done(rename(temporary.c_str(), file.c_str()));
  } catch (const std::system_error& failure) {
    unlink(temporary.c_str());
    throw Error(file.string() + ": cannot be written: " + failure.code().message());
  }
}

}  // namespace dtr
