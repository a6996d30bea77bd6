#include "dtr/io/mesh_io.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/plain_bytes.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr char kMeshMagic[9] = "DTRMESH1";
constexpr size_t kHashBytes = 32;
constexpr std::uintmax_t kLargestMeshBytes = std::uintmax_t{512} << 20;
constexpr int kMaxSamples = 1 << 20;  // a side: an image has at most 400 Mpx
constexpr double kNoAbsoluteBreak = -1;
constexpr int kRootSide = BlockCover::kRootSide;
static_assert(kRootSide == 16, "a rectangle is four numbers of 4 bits");

std::string BytesOfHex(const std::string& hex) {
  std::string bytes(kHashBytes, '\0');
  for (size_t i = 0; i < hex.size(); ++i) {
    const int digit = hex[i] <= '9' ? hex[i] - '0' : hex[i] - 'a' + 10;
    bytes[i / 2] = static_cast<char>(bytes[i / 2] | digit << (i % 2 == 0 ? 4 : 0));
  }
  return bytes;
}

/// "" for zeros: no file has that hash.
std::string HexOfBytes(std::string_view bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  if (bytes == std::string(kHashBytes, '\0')) return "";
  std::string hex;
  for (const char c : bytes) {
    hex += kDigits[static_cast<unsigned char>(c) >> 4];
    hex += kDigits[static_cast<unsigned char>(c) & 15];
  }
  return hex;
}

int RootsAlong(int samples) { return (samples + kRootSide - 1) / kRootSide; }

/// Takes plain values one after the other; throws where they end.
class MeshBytes {
 public:
  MeshBytes(std::string_view content, const fs::path& file) : rest_(content), file_(file) {}
  std::string_view Take(size_t count) {
    if (rest_.size() < count) Fail("more bytes", "the end");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  template <typename T>
  T Take() {
    T value;
    std::memcpy(&value, Take(sizeof(T)).data(), sizeof(T));
    return value;
  }
  size_t left() const { return rest_.size(); }
  [[noreturn]] void Fail(const std::string& expected, const std::string& found) const {
    throw Error(file_.string() + ": reduced mesh: expected " + expected + ", found " + found +
                "; `dtr stereo` writes it again");
  }

 private:
  std::string_view rest_;
  const fs::path& file_;
};

double TakeThreshold(MeshBytes& bytes, double smallest) {
  const auto value = bytes.Take<double>();
  if (!std::isfinite(value) || (value < 0 && value != smallest)) {
    bytes.Fail("a threshold of at least 0", std::to_string(value));
  }
  return value;
}

StoredMesh FromText(const std::string& content, const fs::path& file) {
  MeshBytes bytes(content, file);
  if (bytes.Take(8) != std::string_view(kMeshMagic, 8)) bytes.Fail("the magic DTRMESH1", "another");
  StoredMesh mesh;
  BlockCover& cover = mesh.cover;
  const auto take_count = [&](const char* what, std::uint32_t least, std::uint32_t most) {
    const auto value = bytes.Take<std::uint32_t>();
    if (value < least || value > most) bytes.Fail(what, std::to_string(value));
    return static_cast<int>(value);
  };
  mesh.resolution = take_count("a resolution of 1 to 1048576", 1, kMaxSamples);
  cover.columns = take_count("at most 1048576 columns", 0, kMaxSamples);
  cover.rows = take_count("at most 1048576 rows", 0, kMaxSamples);
  take_count("0 in bytes 20 to 23", 0, 0);
  mesh.depth_sha256 = HexOfBytes(bytes.Take(kHashBytes));
  mesh.mask_sha256 = HexOfBytes(bytes.Take(kHashBytes));
  if (mesh.depth_sha256.empty()) bytes.Fail("the hash of a depth file", "zeros");
  mesh.tolerance = TakeThreshold(bytes, 0);
  mesh.depth_break = TakeThreshold(bytes, 0);
  const double absolute = TakeThreshold(bytes, kNoAbsoluteBreak);
  if (absolute >= 0) mesh.absolute_depth_break = absolute;
  const auto count = bytes.Take<std::uint64_t>();
  const std::uint64_t roots =
      static_cast<std::uint64_t>(RootsAlong(cover.columns)) * RootsAlong(cover.rows);
  // Nothing is allocated that the file's own size does not vouch for.
  if (roots > bytes.left() / 2 || count != (bytes.left() - 2 * roots) / 2 || bytes.left() % 2) {
    bytes.Fail("the bytes of " + std::to_string(count) + " rectangles in " + std::to_string(roots) +
                   " root squares",
               std::to_string(content.size()) + " bytes in all");
  }
  cover.rectangles.reserve(count);
  for (int y = 0; y < cover.rows; y += kRootSide) {
    for (int x = 0; x < cover.columns; x += kRootSide) {
      const auto in_root = bytes.Take<std::uint16_t>();
      std::array<std::uint32_t, kRootSide> taken{};  // a row of blocks each
      for (int i = 0; i < in_root; ++i) {
        const unsigned code = bytes.Take<std::uint16_t>();
        const BlockCover::Rectangle r{
            x + static_cast<int>(code & 15), y + static_cast<int>(code >> 4 & 15),
            1 + static_cast<int>(code >> 8 & 15), 1 + static_cast<int>(code >> 12)};
        if (r.x + r.width >= cover.columns || r.y + r.height >= cover.rows ||
            r.x + r.width > x + kRootSide || r.y + r.height > y + kRootSide) {
          bytes.Fail("rectangles within the map and their root square", "one beyond");
        }
        // Meshes are cut along the borders of rectangles, which must not cross.
        const std::uint32_t blocks = ((1u << r.width) - 1) << (r.x - x);
        for (int row = r.y - y; row < r.y - y + r.height; ++row) {
          std::uint32_t& of_row = taken[static_cast<size_t>(row)];
          if ((of_row & blocks) != 0)
            bytes.Fail("rectangles apart from each other", "two that overlap");
          of_row |= blocks;
        }
        cover.rectangles.push_back(r);
      }
    }
  }
  if (bytes.left() != 0) bytes.Fail("the end", std::to_string(bytes.left()) + " more bytes");
  return mesh;
}

}  // namespace

void WriteMesh(const fs::path& file, const StoredMesh& mesh) {
  const BlockCover& cover = mesh.cover;
  std::string out(kMeshMagic, 8);
  for (const int number : {mesh.resolution, cover.columns, cover.rows, 0}) {
    Append(out, static_cast<std::uint32_t>(number));
  }
  out += BytesOfHex(mesh.depth_sha256) + BytesOfHex(mesh.mask_sha256);
  Append(out, mesh.tolerance);
  Append(out, mesh.depth_break);
  Append(out, mesh.absolute_depth_break.value_or(kNoAbsoluteBreak));
  Append(out, static_cast<std::uint64_t>(cover.rectangles.size()));
  auto next = cover.rectangles.begin();
  for (int y = 0; y < cover.rows; y += kRootSide) {
    for (int x = 0; x < cover.columns; x += kRootSide) {
      const auto first = next;
      const auto inside = [&](const BlockCover::Rectangle& r) {
        return r.x / kRootSide == x / kRootSide && r.y / kRootSide == y / kRootSide;
      };
      while (next != cover.rectangles.end() && inside(*next)) ++next;
      Append(out, static_cast<std::uint16_t>(next - first));
      for (auto r = first; r != next; ++r) {
        Append(out, static_cast<std::uint16_t>((r->x - x) | (r->y - y) << 4 | (r->width - 1) << 8 |
                                               (r->height - 1) << 12));
      }
    }
  }
  FromText(out, file);  // what is written can be read
  WriteFileAtomically(file, out);
}

StoredMesh ReadMesh(const fs::path& file) {
  return FromText(ReadFile(file, kLargestMeshBytes), file);
}

}  // namespace dtr::io
