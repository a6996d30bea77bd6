// calib/sfm/run/store_reader.h -- internal to calib/sfm/run: a file of the store, read from its
// beginning.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr::sfm {

/// Numbers are as the machine has them: little-endian on all it runs on. Every function throws
/// Error where the file does not hold what it is asked for.
class StoreReader {
 public:
  StoreReader(const std::filesystem::path& file, std::string_view magic)
      : file_(file), in_(StreamOf(file)), left_(std::filesystem::file_size(file)) {
    std::string found(magic.size(), '\0');
    if (left_ < found.size()) Reject("a file cut short");
    Read(found.data(), found.size());
    if (found != magic) Reject("another file");
  }

  template <typename T>
  T Get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    Read(&value, sizeof value);
    return value;
  }
  template <typename T>
  std::vector<T> GetAll(std::uint64_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (count > left_ / sizeof(T)) Reject("a file cut short");
    std::vector<T> values(count);
    Read(values.data(), count * sizeof(T));
    return values;
  }
  void Skip(std::uint64_t bytes) {
    if (bytes > left_) Reject("a file cut short");
    in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
    left_ -= bytes;
  }
  std::uint64_t Left() const { return left_; }

  [[noreturn]] void Reject(const std::string& found) const {
    throw Error(file_.string() +
                ": expected features or matches of structure from motion, found: " + found +
                "; delete the workspace to start again");
  }

 private:
  void Read(void* to, std::uint64_t bytes) {
    const bool all =
        bytes <= left_ && in_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
    if (!all) Reject("a file cut short");
    left_ -= bytes;
  }

  std::filesystem::path file_;
  std::ifstream in_;
  std::uint64_t left_;
};

}  // namespace dtr::sfm
