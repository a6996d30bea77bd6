#include "cli/pipeline/plane_files.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxSidePx = 1 << 16;  // no photo is larger; keeps sizes far from overflow
constexpr std::uintmax_t kLimitBytes = std::uintmax_t{1} << 36;

struct Header {
  std::int32_t width = 0, height = 0;
  double unit_z = 1;
};

void Append(const Grid<float>& grid, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(grid.data().data()),
               grid.data().size() * sizeof(float));
}

}  // namespace

PlaneFiles::PlaneFiles(const fs::path& folder) : folder_(folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": cannot be created: " + error.message());
}

fs::path PlaneFiles::File(int round, int view) const {
  return folder_ / fmt::format("round{}_view{}.planes", round, view);
}

bool PlaneFiles::Has(int round, int view) const {
  const fs::path file = File(round, view);
  std::error_code error;
  const bool found = fs::exists(file, error);
  if (error) throw Error(file.string() + ": cannot be looked for: " + error.message());
  return found;
}

std::shared_ptr<const stereo::PlaneMap> PlaneFiles::Load(int round, int view) {
  const fs::path file = File(round, view);
  const std::string bytes = ReadFile(file, kLimitBytes);
  Header header;
  if (bytes.size() >= sizeof(header)) std::memcpy(&header, bytes.data(), sizeof(header));
  const bool sizes_fit = header.width >= 0 && header.height >= 0 && header.width <= kMaxSidePx &&
                         header.height <= kMaxSidePx && (header.width == 0) == (header.height == 0);
  const size_t count =
      sizes_fit ? static_cast<size_t>(header.width) * static_cast<size_t>(header.height) : 0;
  const size_t expected = sizeof(header) + 3 * count * sizeof(float);
  if (!sizes_fit || bytes.size() != expected || !(header.unit_z > 0)) {
    throw Error(
        fmt::format("{}: expected planes of {}x{} in {} bytes, found {}; delete the partial set "
                    "and build again",
                    file.string(), header.width, header.height, expected, bytes.size()));
  }
  auto map = std::make_shared<stereo::PlaneMap>();
  map->unit_z = header.unit_z;
  if (count == 0) return map;
  const char* next = bytes.data() + sizeof(header);
  for (Grid<float>* grid : {&map->inverse_depth, &map->slope_x, &map->slope_y}) {
    *grid = Grid<float>(header.width, header.height);
    std::memcpy(grid->data().data(), next, count * sizeof(float));
    next += count * sizeof(float);
    for (const float value : grid->data()) {
      if (!std::isfinite(value)) {
        throw Error(file.string() +
                    ": expected finite numbers, found others; delete the partial set and build "
                    "again");
      }
    }
  }
  return map;
}

void PlaneFiles::Save(int round, int view, stereo::PlaneMap&& map) {
  const Header header{map.inverse_depth.width(), map.inverse_depth.height(), map.unit_z};
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof(header));
  bytes.reserve(sizeof(header) + 3 * map.inverse_depth.data().size() * sizeof(float));
  if (!map.empty()) {
    for (const Grid<float>* grid : {&map.inverse_depth, &map.slope_x, &map.slope_y}) {
      Append(*grid, bytes);
    }
  }
  WriteFileAtomically(File(round, view), bytes);
}

void PlaneFiles::Drop(int round) {
  const std::string prefix = fmt::format("round{}_view", round);
  std::error_code error;
  fs::directory_iterator entry(folder_, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const fs::path file = entry->path();
    if (!file.filename().string().starts_with(prefix)) continue;
    fs::remove(file, error);
    if (error) throw Error(file.string() + ": cannot be removed: " + error.message());
  }
  if (error) throw Error(folder_.string() + ": cannot be listed: " + error.message());
}

}  // namespace dtr::pipeline
