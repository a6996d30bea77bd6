#include "pipeline/core/depth/grid_files.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxSidePx = 1 << 16;  // no photo is larger; keeps sizes far from overflow
constexpr std::uintmax_t kLimitBytes = std::uintmax_t{1} << 36;

struct Header {
  std::int32_t width = 0, height = 0;
  double unit = 1;
};

}  // namespace

void WriteGridFile(const fs::path& file, std::span<const Grid<float>* const> grids, double unit) {
  const Header header{grids.front()->width(), grids.front()->height(), unit};
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof(header));
  const size_t grid_bytes = grids.front()->data().size() * sizeof(float);
  bytes.reserve(sizeof(header) + grids.size() * grid_bytes);
  for (const Grid<float>* grid : grids) {
    bytes.append(reinterpret_cast<const char*>(grid->data().data()), grid_bytes);
  }
  WriteFileAtomically(file, bytes);
}

double ReadGridFile(const fs::path& file, std::span<Grid<float>* const> grids) {
  const std::string bytes = ReadFile(file, kLimitBytes);
  Header header;
  if (bytes.size() >= sizeof(header)) std::memcpy(&header, bytes.data(), sizeof(header));
  const bool sizes_fit = header.width >= 0 && header.height >= 0 && header.width <= kMaxSidePx &&
                         header.height <= kMaxSidePx && (header.width == 0) == (header.height == 0);
  const size_t count =
      sizes_fit ? static_cast<size_t>(header.width) * static_cast<size_t>(header.height) : 0;
  const size_t expected = sizeof(header) + grids.size() * count * sizeof(float);
  if (!sizes_fit || bytes.size() != expected || !(header.unit > 0) || !std::isfinite(header.unit)) {
    throw Error(fmt::format(
        "{}: expected grids of {}x{} in {} bytes, found {}; delete the partial set and build again",
        file.string(), header.width, header.height, expected, bytes.size()));
  }
  if (count == 0) return header.unit;
  const char* next = bytes.data() + sizeof(header);
  for (Grid<float>* grid : grids) {
    *grid = Grid<float>(header.width, header.height);
    std::memcpy(grid->data().data(), next, count * sizeof(float));
    next += count * sizeof(float);
    for (const float value : grid->data()) {
      if (std::isfinite(value)) continue;
      throw Error(file.string() +
                  ": expected finite numbers, found others; delete the partial set and build "
                  "again");
    }
  }
  return header.unit;
}

}  // namespace dtr::pipeline
