// dtr/io/formats/file_look.h -- what a file of unknown format looks like from outside.
#pragma once
#include <filesystem>
#include <set>
#include <string>

namespace dtr::io {

/// Enough of a file to tell formats apart, whatever it is called.
struct FileLook {
  bool is_folder = false;
  std::string head;           ///< the first 64 KiB
  bool is_json = false;       ///< begins as JSON does
  bool is_json_list = false;  ///< with [
  bool is_broken = false;     ///< begins so, and is no JSON further on
  /// Names of the fields of the JSON object, or of the first object of the list, as far as the file
  /// is JSON.
  std::set<std::string> keys;

  bool Has(const char* key) const { return keys.contains(key); }
};

/// Looks at a file or folder. Throws Error where it cannot be read.
FileLook LookAt(const std::filesystem::path& file);

}  // namespace dtr::io
