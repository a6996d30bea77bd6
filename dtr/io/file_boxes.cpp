#include "dtr/io/file_boxes.h"
#include "dtr/base/regular_file.h"

#include <algorithm>

namespace dtr::io {
namespace {

constexpr std::uint64_t kLargestPiece = 64 << 20;  // of what is read into memory

}  // namespace

FileBytes::FileBytes(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return;
  in_ = StreamOf(file);
  size_ = std::filesystem::file_size(file);
}

std::string FileBytes::At(std::uint64_t offset, std::uint64_t count) {
  if (offset > size_ || count > size_ - offset || count > kLargestPiece) return {};
  std::string bytes(static_cast<size_t>(count), '\0');
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(offset));
  in_.read(bytes.data(), static_cast<std::streamsize>(count));
  return in_ ? bytes : std::string();
}

std::uint64_t Big(std::string_view bytes, size_t at, size_t count) {
  if (at > bytes.size() || count > bytes.size() - at) return 0;
  std::uint64_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

std::vector<Box> BoxesIn(FileBytes& file, std::uint64_t begin, std::uint64_t end) {
  constexpr size_t kMaxBoxes = 10'000;
  std::vector<Box> boxes;
  for (std::uint64_t at = begin; at + 8 <= end && boxes.size() < kMaxBoxes;) {
    const std::string head = file.At(at, std::min<std::uint64_t>(16, end - at));
    if (head.size() < 8) break;
    std::uint64_t size = Big(head, 0, 4), header = 8;
    if (size == 1 && head.size() == 16) {
      size = Big(head, 8, 8);
      header = 16;
    }
    if (size == 0) size = end - at;
    if (size < header || size > end - at) break;
    boxes.push_back({head.substr(4, 4), at + header, at + size});
    at += size;
  }
  return boxes;
}

const Box* FindBox(const std::vector<Box>& boxes, std::string_view type) {
  const auto found =
      std::find_if(boxes.begin(), boxes.end(), [&](const Box& box) { return box.type == type; });
  return found == boxes.end() ? nullptr : &*found;
}

std::string ContentOf(FileBytes& file, const Box* box) {
  return box == nullptr ? std::string() : file.At(box->begin, box->end - box->begin);
}

}  // namespace dtr::io
