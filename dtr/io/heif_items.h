// dtr/io/heif_items.h -- internal to dtr/io: what HEIF and AVIF files consist of.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/io/file_boxes.h"

namespace dtr::io {

/// Whether a file begins as HEIF or AVIF does.
bool IsHeif(const std::filesystem::path& file);

struct HeifItem {
  std::uint64_t id = 0;
  std::string type;  ///< four characters: "hvc1", "grid", "Exif", ...
};

/// The items of a file's `meta` box (ISO 14496-12, 8.11); none where it has no such box.
class HeifItems {
 public:
  explicit HeifItems(const std::filesystem::path& file);

  const std::vector<HeifItem>& items() const { return items_; }
  /// Empty where the item lies elsewhere than in the file or in `idat`, or a number is broken.
  std::string BytesOf(const HeifItem& item);
  /// Contents of the image properties of a type, as "ispe", from behind the version and flags.
  std::vector<std::string> Properties(const std::string& type);

 private:
  FileBytes file_;
  std::vector<Box> boxes_;  ///< in `meta`
  std::vector<HeifItem> items_;
};

}  // namespace dtr::io
