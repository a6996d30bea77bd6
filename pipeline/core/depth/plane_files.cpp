#include "pipeline/core/depth/plane_files.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "pipeline/core/depth/grid_files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr char kRanges[] = "ranges.json";
constexpr std::uintmax_t kRangeBytes = 64;  // of one range as text, at most

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": cannot be created: " + error.message());
}

bool Exists(const fs::path& file) {
  std::error_code error;
  const bool found = fs::exists(file, error);
  if (error) throw Error(file.string() + ": cannot be looked for: " + error.message());
  return found;
}

// False too for a file that was damaged: that costs time, never the job.
bool Reads(const fs::path& file, const std::string& text) {
  try {
    return ReadFile(file, text.size()) == text;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

PlaneFiles::PlaneFiles(const fs::path& folder, const std::string& made_from, bool is_shared)
    : folder_(folder) {
  const fs::path origin = folder / "made_from";
  if (Exists(origin) && Reads(origin, made_from)) return;
  if (is_shared && !Exists(origin)) {
    throw Error(
        "depth: expected depth ranges that were found, found none; run the stage ranges "
        "first");
  }
  if (is_shared) {
    throw Error(folder.string() +
                ": expected planes of the frozen cameras, found others; dtr build without "
                "a stage finds depth again");
  }
  RemoveTree(folder);
  MakeFolder(folder);
  WriteFileAtomically(origin, made_from);
}

fs::path PlaneFiles::File(int pass, int view) const {
  return folder_ / fmt::format("round{}_view{}.planes", pass, view);
}

bool PlaneFiles::Has(int pass, int view) const { return Exists(File(pass, view)); }

std::shared_ptr<const stereo::PlaneMap> PlaneFiles::Load(int pass, int view) {
  auto map = std::make_shared<stereo::PlaneMap>();
  map->unit_z =
      ReadGridFile(File(pass, view), std::array{&map->inverse_depth, &map->slope_x, &map->slope_y});
  return map;
}

void PlaneFiles::Save(int pass, int view, stereo::PlaneMap&& map) {
  const std::array<const Grid<float>*, 3> grids{&map.inverse_depth, &map.slope_x, &map.slope_y};
  WriteGridFile(File(pass, view), grids, map.unit_z);
}

void PlaneFiles::Drop(int pass) {
  const std::string prefix = fmt::format("round{}_view", pass);
  std::error_code error;
  fs::directory_iterator entry(folder_, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->path().filename().string().starts_with(prefix)) RemoveTree(entry->path());
  }
  if (error) throw Error(folder_.string() + ": cannot be listed: " + error.message());
}

void PlaneFiles::SaveRanges(std::span<const stereo::DepthRange> ranges) {
  auto json = nlohmann::json::array();
  for (const stereo::DepthRange& range : ranges) json.push_back({range.near_z, range.far_z});
  WriteFileAtomically(folder_ / kRanges, json.dump() + "\n");
}

std::optional<std::vector<stereo::DepthRange>> PlaneFiles::LoadRanges(size_t views) const {
  if (!Exists(folder_ / kRanges)) return std::nullopt;
  try {
    const auto json = nlohmann::json::parse(ReadFile(folder_ / kRanges, kRangeBytes * (views + 1)));
    if (!json.is_array() || json.size() != views) return std::nullopt;
    std::vector<stereo::DepthRange> ranges;
    for (const auto& pair : json) {
      ranges.push_back({pair.at(0).get<double>(), pair.at(1).get<double>()});
      const auto& [near_z, far_z] = ranges.back();
      if (!(near_z > 0) || !(far_z > near_z) || !std::isfinite(far_z)) return std::nullopt;
    }
    return ranges;
  } catch (const Error&) {
    return std::nullopt;  // a damaged checkpoint costs time, never the job
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

EstimateFiles::EstimateFiles(const fs::path& folder) : folder_(folder) {
  RemoveTree(folder);
  MakeFolder(folder);
}

fs::path EstimateFiles::File(int view) const { return folder_ / fmt::format("view{}.depth", view); }

bool EstimateFiles::Has(int view) const { return Exists(File(view)); }

std::shared_ptr<const stereo::DepthEstimate> EstimateFiles::Load(int view) {
  auto estimate = std::make_shared<stereo::DepthEstimate>();
  ReadGridFile(File(view), std::array{&estimate->depth.grid(), &estimate->inverse_depth_sigma});
  return estimate;
}

void EstimateFiles::Save(int view, stereo::DepthEstimate&& estimate) {
  const std::array<const Grid<float>*, 2> grids{&estimate.depth.grid(),
                                                &estimate.inverse_depth_sigma};
  WriteGridFile(File(view), grids);
}

void EstimateFiles::Drop(int view) { RemoveTree(File(view)); }

}  // namespace dtr::pipeline
