// dtr/io/file_boxes.h -- internal to dtr/io: pieces of files that image libraries do not hand out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace dtr::io {

/// Bytes of a file; what lies beyond its end, or is larger than 64 MiB, is empty.
class FileBytes {
 public:
  explicit FileBytes(const std::filesystem::path& file);
  std::uint64_t size() const { return size_; }
  std::string At(std::uint64_t offset, std::uint64_t count);

 private:
  std::ifstream in_;
  std::uint64_t size_ = 0;
};

/// Big-endian number of so many bytes; 0 where they are not there.
std::uint64_t Big(std::string_view bytes, size_t at, size_t count);

/// A box of ISO 14496-12: what lies in it.
struct Box {
  std::string type;
  std::uint64_t begin = 0, end = 0;
};

/// The boxes between two places of a file, up to the first that is broken.
std::vector<Box> BoxesIn(FileBytes& file, std::uint64_t begin, std::uint64_t end);
/// The first of a type; null: there is none.
const Box* FindBox(const std::vector<Box>& boxes, std::string_view type);
/// Its bytes; empty for null.
std::string ContentOf(FileBytes& file, const Box* box);

}  // namespace dtr::io
