#include "cli/output_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "dtr/base/error.h"
#include "dtr/base/lower_case.h"

namespace dtr::cli {
namespace fs = std::filesystem;

void RequireFolderOf(const fs::path& file, const std::string& option) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) {
    if (access(folder.c_str(), W_OK) == 0) return;
    throw Error(
        fmt::format("{} {}: expected a folder that can be written to, found {}, which cannot: {}",
                    option, file.string(), folder.string(), std::strerror(errno)));
  }
  throw UsageError(fmt::format(
      "{} {}: expected an existing folder to write into, found {} at {}", option, file.string(),
      fs::exists(folder, ignored) ? "a file" : "nothing", folder.string()));
}

void RequireOutputFile(const fs::path& file, const std::string& option,
                       const std::vector<std::string>& extensions) {
  const std::string extension = LowerExtension(file);
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
    throw UsageError(fmt::format("{} {}: expected a name ending in {}, found '{}'", option,
                                 file.string(), fmt::join(extensions, " or "), extension));
  }
  RequireFolderOf(file, option);
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) {
    throw UsageError(
        fmt::format("{} {}: expected a file name, found a folder", option, file.string()));
  }
}

}  // namespace dtr::cli
