#include "dtr/io/heif_items.h"

#include <algorithm>

namespace dtr::io {
namespace {

constexpr std::uint64_t kFullBox = 4;  // version and flags
constexpr size_t kMaxItems = 100'000, kMaxExtents = 1000;

// ISO 14496-12, 8.11.6: iinf holds infe boxes of version 2 or 3.
std::vector<HeifItem> ItemsIn(FileBytes& file, const Box& iinf) {
  std::vector<HeifItem> items;
  const std::string head = file.At(iinf.begin, 1);
  const std::uint64_t counter = Big(head, 0, 1) == 0 ? 2 : 4;
  for (const Box& box : BoxesIn(file, iinf.begin + kFullBox + counter, iinf.end)) {
    if (box.type != "infe") continue;
    const std::string content =
        file.At(box.begin, std::min<std::uint64_t>(14, box.end - box.begin));
    const std::uint64_t version = Big(content, 0, 1);
    if (version < 2 || version > 3) continue;
    const size_t id_bytes = version == 2 ? 2 : 4;
    if (content.size() < 4 + id_bytes + 6) continue;
    items.push_back({Big(content, 4, id_bytes), content.substr(4 + id_bytes + 2, 4)});
  }
  return items;
}

// Walks through the fields of an `iloc`; what lies beyond its end is 0 and ends the walk.
struct Fields {
  const std::string& bytes;
  size_t at = 0;
  std::uint64_t Next(size_t count) {
    const std::uint64_t value = Big(bytes, at, count);
    at += count;
    return value;
  }
  bool AtEnd() const { return at > bytes.size(); }
};

// Bytes of an item (ISO 14496-12, 8.11.3); empty where it is not there.
std::string ItemBytes(FileBytes& file, const std::string& iloc, const Box* idat,
                      std::uint64_t wanted) {
  Fields fields{iloc};
  const std::uint64_t version = fields.Next(1);
  fields.Next(3);
  const std::uint64_t sizes = fields.Next(2);
  const size_t offset_size = sizes >> 12 & 15, length_size = sizes >> 8 & 15,
               base_size = sizes >> 4 & 15, index_size = version == 0 ? 0 : sizes & 15;
  if (version > 2 || offset_size > 8 || length_size > 8 || base_size > 8 || index_size > 8) {
    return {};
  }
  const std::uint64_t count = fields.Next(version < 2 ? 2 : 4);
  for (std::uint64_t i = 0; i < count && i < kMaxItems && !fields.AtEnd(); ++i) {
    const std::uint64_t item = fields.Next(version < 2 ? 2 : 4);
    const std::uint64_t method = version == 0 ? 0 : fields.Next(2) & 15;
    const std::uint64_t elsewhere = fields.Next(2);
    const std::uint64_t base = fields.Next(base_size);
    const std::uint64_t extents = fields.Next(2);
    std::string bytes;
    for (std::uint64_t e = 0; e < extents && e < kMaxExtents && !fields.AtEnd(); ++e) {
      fields.Next(index_size);
      const std::uint64_t offset = fields.Next(offset_size), length = fields.Next(length_size);
      if (item != wanted || fields.AtEnd()) continue;
      if (elsewhere != 0 || method > 1 || (method == 1 && idat == nullptr)) return {};
      const std::uint64_t from = base + offset;
      if (from < base) return {};
      if (method == 1 &&
          (from > idat->end - idat->begin || length > idat->end - idat->begin - from)) {
        return {};
      }
      const std::string part = file.At(method == 1 ? idat->begin + from : from, length);
      if (part.size() != length || bytes.size() + part.size() > (64u << 20)) return {};
      bytes += part;
    }
    if (item == wanted) return bytes;
  }
  return {};
}

}  // namespace

bool IsHeif(const std::filesystem::path& path) {
  FileBytes file(path);
  const std::string start = file.At(0, 12);
  return start.size() == 12 && start.compare(4, 4, "ftyp") == 0;
}

HeifItems::HeifItems(const std::filesystem::path& file) : file_(file) {
  const auto top = BoxesIn(file_, 0, file_.size());
  const Box* meta = FindBox(top, "meta");
  if (meta == nullptr) return;
  boxes_ = BoxesIn(file_, meta->begin + kFullBox, meta->end);
  if (const Box* iinf = FindBox(boxes_, "iinf")) items_ = ItemsIn(file_, *iinf);
}

std::string HeifItems::BytesOf(const HeifItem& item) {
  return ItemBytes(file_, ContentOf(file_, FindBox(boxes_, "iloc")), FindBox(boxes_, "idat"),
                   item.id);
}

std::vector<std::string> HeifItems::Properties(const std::string& type) {
  std::vector<std::string> contents;
  const Box* iprp = FindBox(boxes_, "iprp");
  if (iprp == nullptr) return contents;
  const auto in_iprp = BoxesIn(file_, iprp->begin, iprp->end);
  const Box* ipco = FindBox(in_iprp, "ipco");
  if (ipco == nullptr) return contents;
  for (const Box& box : BoxesIn(file_, ipco->begin, ipco->end)) {
    if (box.type != type) continue;
    const std::string content = ContentOf(file_, &box);
    if (content.size() >= kFullBox) contents.push_back(content.substr(kFullBox));
  }
  return contents;
}

}  // namespace dtr::io
