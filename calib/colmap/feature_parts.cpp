#include "calib/colmap/feature_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "calib/colmap/database.h"
#include "calib/colmap/graph_database.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

constexpr char kNote[] = ".begun", kPart[] = ".part_";

// Everything beside the database of all that belongs to parts.
std::vector<fs::path> FilesOfParts(const fs::path& database) {
  const std::string prefix = database.filename().string() + kPart;
  std::vector<fs::path> files;
  std::error_code error;
  fs::directory_iterator entry(database.parent_path(), error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->path().filename().string().starts_with(prefix)) files.push_back(entry->path());
  }
  if (error) {
    throw Error(database.parent_path().string() + ": cannot be listed: " + error.message());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

fs::path NoteOf(const fs::path& database) { return database.string() + kNote; }

fs::path PartOf(const fs::path& database, const Part& part) {
  return fmt::format("{}{}{}_of_{}", database.string(), kPart, part.index, part.count);
}

FeatureParts::FeatureParts(Workspace& workspace, const fs::path& database) : database_(database) {
  for (const fs::path& file : FilesOfParts(database)) {
    if (file.extension() != kNote) continue;
    const fs::path part = fs::path(file).replace_extension();
    if (!fs::exists(part) || !workspace.Kept(file)) continue;
    for (const auto& [image_id, count] : ReadDatabaseMatches(part).features) {
      part_of_.emplace(image_id, part);
    }
  }
}

std::optional<sfm::Features> FeatureParts::Of(std::uint32_t image_id) const {
  const auto part = part_of_.find(image_id);
  if (part == part_of_.end()) return std::nullopt;
  return ReadFeatures(part->second, image_id);
}

void FeatureParts::Remove() const {
  for (const fs::path& file : FilesOfParts(database_)) RemoveTree(file);
}

}  // namespace dtr::colmap
