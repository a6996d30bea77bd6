#include "dtr/io/heif_exif.h"

#include <algorithm>

#include "dtr/io/file_boxes.h"
#include "dtr/io/heif_items.h"

namespace dtr::io {

std::string ReadHeifExif(const std::filesystem::path& file) {
  HeifItems heif(file);
  const auto item = std::find_if(heif.items().begin(), heif.items().end(),
                                 [](const HeifItem& one) { return one.type == "Exif"; });
  if (item == heif.items().end()) return {};
  const std::string bytes = heif.BytesOf(*item);
  if (bytes.size() < 4) return {};
  const std::uint64_t begin = 4 + Big(bytes, 0, 4);
  if (begin >= bytes.size()) return {};
  const std::string tiff = bytes.substr(static_cast<size_t>(begin));
  return tiff.starts_with("II*") || tiff.starts_with("MM") ? tiff : std::string();
}

}  // namespace dtr::io
