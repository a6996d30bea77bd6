// dtr/base/file_stream.h -- large files, written piece by piece.
#pragma once
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "dtr/base/open_file.h"

namespace dtr {

/// A new file; a link or a file of its name goes first. Numbers are written as the machine has
/// them: little-endian on all it runs on. Every function throws Error where the disk rejects what
/// it is given.
class FileStream {
 public:
  explicit FileStream(std::filesystem::path file);

  void Write(std::string_view bytes);
  template <typename T>
  void Put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    Write({bytes, sizeof value});
  }
  /// Writes what is buffered. What is not written when the stream goes is lost.
  void Flush();
  /// Flush, then `bytes` in the place of as many at the file's beginning.
  void Replace(std::string_view bytes);

 private:
  std::filesystem::path file_;
  std::string buffer_;
  std::optional<OpenFile> open_;
};

}  // namespace dtr
