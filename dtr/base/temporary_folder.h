// dtr/base/temporary_folder.h -- a folder for as long as a scope lasts.
#pragma once
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "dtr/base/error.h"

namespace dtr {

/// A fresh folder, removed with everything in it at the end of the scope. Throws Error where none
/// can be made.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "dtr_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) {
      throw Error(pattern +
                  ": expected to create a temporary folder, found: " + std::strerror(errno));
    }
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace dtr
