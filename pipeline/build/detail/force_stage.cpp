#include "pipeline/build/detail/force_stage.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "pipeline/build/build.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// What each stage leaves, below the partial set; the order is the stages'.
struct KeptStage {
  const char* stage;
  std::vector<std::string> paths;
};

const std::vector<KeptStage>& AllKept() {
  static const std::vector<KeptStage> kAll{
      {"capture", {"work/capture", "work/frames"}},
      {"calibration", {"work/calibration"}},
      {"undistortion", {"images", "mask", "held_out", "work/views"}},
      {"depth",
       {"depth", "sigma", "mesh", "work/planes", "work/estimates", "work/effort.json",
        "work/colmap"}}};
  return kAll;
}

}  // namespace

std::vector<std::string> StagesKept() {
  std::vector<std::string> names;
  for (const KeptStage& kept : AllKept()) names.emplace_back(kept.stage);
  return names;
}

void ForgetStage(const fs::path& folder, const std::string& name) {
  const auto& all = AllKept();
  const auto from = std::find_if(all.begin(), all.end(),
                                 [&](const KeptStage& kept) { return kept.stage == name; });
  if (from == all.end()) {
    throw UsageError(
        fmt::format("`force_stage` {}: expected one of {}", name, fmt::join(StagesKept(), ", ")));
  }
  // Records of parts, and the cameras frozen for them, would speak of what is gone; then later
  // stages first: should this be cut off, what is left is the work of an earlier moment.
  const auto remove = [&](const std::string& path) { RemoveTree(folder / path); };
  for (const char* of_parts : {"work/parts", "work/frozen_cameras"}) remove(of_parts);
  for (auto kept = all.end(); kept-- != from;) {
    for (const std::string& path : kept->paths) remove(path);
  }
}

}  // namespace dtr::pipeline
