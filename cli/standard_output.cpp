#include "cli/standard_output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "dtr/base/error.h"

namespace dtr::cli {

void WriteOut(const std::string& text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0) {
    throw Error(std::string("standard output: cannot be written: ") + std::strerror(errno));
  }
}

void WriteErr(const std::string& text) noexcept {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

}  // namespace dtr::cli
