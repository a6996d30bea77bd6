#include "dtr/io/file_colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "dtr/io/file_boxes.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
void State(int primaries, int transfer, FileColours& colours) {
  colours.coding = CodingOfH273(primaries, transfer);
  if (colours.coding) return;
  colours.unsupported =
      fmt::format("colours of primaries {} and transfer function {} (numbers of ITU-T H.273)",
                  primaries, transfer);
}

// PNG specification, third edition: cICP goes before iCCP, that before sRGB, gAMA and cHRM.
struct PngChunks {
  std::string cicp, gama, chrm;
  bool iccp = false, srgb = false;
};

PngChunks ReadPngChunks(FileBytes& file) {
  PngChunks chunks;
  for (std::uint64_t at = 8; at + 12 <= file.size();) {
    const std::string head = file.At(at, 8);
    if (head.size() < 8) break;
    const std::uint64_t length = Big(head, 0, 4);
    const std::string name = head.substr(4);
    if (name == "IDAT" || name == "IEND") break;
    if (name == "cICP") chunks.cicp = file.At(at + 8, length);
    if (name == "gAMA") chunks.gama = file.At(at + 8, length);
    if (name == "cHRM") chunks.chrm = file.At(at + 8, length);
    chunks.iccp = chunks.iccp || name == "iCCP";
    chunks.srgb = chunks.srgb || name == "sRGB";
    at += 12 + length;
  }
  return chunks;
}

FileColours PngColours(FileBytes& file) {
  constexpr double kUnit = 1e5;
  constexpr double kUsualGamma = 0.45455, kNear = 0.01;  // old programs write this of sRGB
  FileColours colours;
  const PngChunks chunks = ReadPngChunks(file);
  if (chunks.cicp.size() == 4) {
    State(static_cast<int>(Big(chunks.cicp, 0, 1)), static_cast<int>(Big(chunks.cicp, 1, 1)),
          colours);
    return colours;
  }
  if (chunks.iccp || chunks.srgb || (chunks.gama.empty() && chunks.chrm.empty())) return colours;
  ColourCoding coding;
  const double gamma = static_cast<double>(Big(chunks.gama, 0, 4)) / kUnit;
  if (chunks.gama.size() == 4 && gamma > 0 && std::abs(gamma - kUsualGamma) > kNear) {
    coding.transfer = std::abs(gamma - 1) < kNear ? Transfer::kLinear : Transfer::kGamma;
    coding.gamma = 1 / gamma;
  }
  if (chunks.chrm.size() == 32) {
    const auto at = [&](size_t i) -> Eigen::Vector2d {
      return Eigen::Vector2d(static_cast<double>(Big(chunks.chrm, 8 * i, 4)),
                             static_cast<double>(Big(chunks.chrm, 8 * i + 4, 4))) /
             kUnit;
    };
    coding.primaries = {at(1), at(2), at(3), at(0)};
  }
  colours.coding = coding;
  return colours;
}

// RFC 9649; empty where there is none.
std::string WebpChunk(FileBytes& file, std::string_view name) {
  for (std::uint64_t at = 12; at + 8 <= file.size();) {
    const std::string head = file.At(at, 8);
    if (head.size() < 8) break;
    std::uint64_t length = 0;
    for (size_t i = 8; i-- > 4;) length = length << 8 | static_cast<unsigned char>(head[i]);
    if (head.starts_with(name)) return file.At(at + 8, length);
    at += 8 + length + length % 2;
  }
  return {};
}

bool IsWebp(const std::string& start) {
  return start.starts_with("RIFF") && start.substr(8) == "WEBP";
}

FileColours WebpColours(FileBytes& file) {
  FileColours colours;
  const std::string icc = WebpChunk(file, "ICCP");
  colours.icc.assign(icc.begin(), icc.end());
  return colours;
}

// The properties, counted from 1, of an item (ISO 23008-12, 9.3.2, "ipma").
std::vector<size_t> PropertiesOf(const std::string& ipma, std::uint64_t item) {
  const bool long_ids = Big(ipma, 0, 1) >= 1, long_indices = (Big(ipma, 3, 1) & 1) != 0;
  const size_t id_bytes = long_ids ? 4 : 2, index_bytes = long_indices ? 2 : 1;
  size_t at = 8;
  for (std::uint64_t left = Big(ipma, 4, 4); left > 0 && at < ipma.size(); --left) {
    const std::uint64_t id = Big(ipma, at, id_bytes);
    const auto count = static_cast<size_t>(Big(ipma, at + id_bytes, 1));
    at += id_bytes + 1;
    if (id != item) {
      at += count * index_bytes;
      continue;
    }
    std::vector<size_t> indices;
    for (size_t i = 0; i < count; ++i, at += index_bytes) {
      const std::uint64_t most = long_indices ? 0x7fff : 0x7f;  // without the bit "essential"
      indices.push_back(static_cast<size_t>(Big(ipma, at, index_bytes) & most));
    }
    return indices;
  }
  return {};
}

FileColours HeifColours(FileBytes& file) {
  constexpr std::uint64_t kFullBox = 4;  // version and flags
  FileColours colours;
  const auto top = BoxesIn(file, 0, file.size());
  const Box* meta = FindBox(top, "meta");
  if (meta == nullptr) return colours;
  const auto in_meta = BoxesIn(file, meta->begin + kFullBox, meta->end);
  const std::string primary = ContentOf(file, FindBox(in_meta, "pitm"));
  const Box* iprp = FindBox(in_meta, "iprp");
  if (primary.size() < 6 || iprp == nullptr) return colours;
  const auto in_iprp = BoxesIn(file, iprp->begin, iprp->end);
  const Box* ipco = FindBox(in_iprp, "ipco");
  if (ipco == nullptr) return colours;
  const auto properties = BoxesIn(file, ipco->begin, ipco->end);
  const std::uint64_t item = Big(primary, 4, Big(primary, 0, 1) == 0 ? 2 : 4);
  for (const size_t index : PropertiesOf(ContentOf(file, FindBox(in_iprp, "ipma")), item)) {
    if (index == 0 || index > properties.size() || properties[index - 1].type != "colr") continue;
    const std::string content = ContentOf(file, &properties[index - 1]);
    if (content.starts_with("nclx") && content.size() >= 8) {
      State(static_cast<int>(Big(content, 4, 2)), static_cast<int>(Big(content, 6, 2)), colours);
    } else if (content.starts_with("prof") || content.starts_with("rICC")) {
      colours.icc.assign(content.begin() + 4, content.end());
    }
  }
  // HDR is stated by numbers; of other images a profile is the more exact statement (ISO 23008-12).
  if (!colours.icc.empty() && colours.coding && !IsHdr(*colours.coding)) colours.coding.reset();
  if (!colours.icc.empty()) colours.unsupported.clear();
  return colours;
}

}  // namespace

FileColours ReadFileColours(const fs::path& path) {
  FileBytes file(path);
  const std::string start = file.At(0, 12);
  if (start.starts_with("\x89PNG")) return PngColours(file);
  if (IsWebp(start)) return WebpColours(file);
  if (start.size() == 12 && start.substr(4, 4) == "ftyp") return HeifColours(file);
  return {};
}

std::string ReadWebpExif(const fs::path& path) {
  constexpr std::string_view kJpegsStart("Exif\0\0", 6);  // some programs put it before
  FileBytes file(path);
  if (!IsWebp(file.At(0, 12))) return {};
  std::string exif = WebpChunk(file, "EXIF");
  if (exif.starts_with(kJpegsStart)) exif.erase(0, kJpegsStart.size());
  return exif;
}

}  // namespace dtr::io
