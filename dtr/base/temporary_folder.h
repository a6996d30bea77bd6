// dtr/base/temporary_folder.h -- a folder for as long as a scope lasts.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

namespace dtr {

class OpenFile;

/// A fresh folder, removed with everything in it at the end of the scope. One that outlived its
/// process, which was killed, is removed by the next that is made beside it: the system ends the
/// lock on it with its owner, however that ends. Where folders cannot be locked it stays.
class TemporaryFolder {
 public:
  /// Where the system keeps what is temporary.
  TemporaryFolder() : TemporaryFolder(std::filesystem::temp_directory_path(), "dtr-tmp-") {}
  /// Below `parent`, which must be there; `prefix` is the beginning of its name, and nothing but
  /// such folders may be called so. Throws Error where none can be made.
  TemporaryFolder(const std::filesystem::path& parent, const std::string& prefix);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
  std::unique_ptr<OpenFile> lock_;
};

}  // namespace dtr
