#include "calib/sfm/run/feature_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"

namespace dtr::sfm {
namespace fs = std::filesystem;
namespace {

constexpr char kNote[] = ".begun", kPart[] = ".part_";

// Everything beside the file of all that belongs to parts.
std::vector<fs::path> FilesOfParts(const fs::path& all) {
  const std::string prefix = all.filename().string() + kPart;
  std::vector<fs::path> files;
  std::error_code error;
  fs::directory_iterator entry(all.parent_path(), error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->path().filename().string().starts_with(prefix)) files.push_back(entry->path());
  }
  if (error) {
    throw Error(all.parent_path().string() + ": cannot be listed: " + error.message());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

fs::path NoteOf(const fs::path& file) { return file.string() + kNote; }

fs::path PartOf(const fs::path& all, const Part& part) {
  return fmt::format("{}{}{}_of_{}", all.string(), kPart, part.index, part.count);
}

FeatureParts::FeatureParts(Workspace& workspace, const fs::path& all) : all_(all) {
  for (const fs::path& file : FilesOfParts(all)) {
    if (file.extension() != kNote) continue;
    const fs::path part = fs::path(file).replace_extension();
    if (!fs::exists(part)) continue;
    if (const auto kept = workspace.Kept(file)) parts_.emplace_back(part, *kept);
  }
}

std::optional<Features> FeatureParts::Of(size_t photo) const {
  for (const FeatureFile& part : parts_) {
    if (part.Has(photo)) return part.Of(photo);
  }
  return std::nullopt;
}

void FeatureParts::Remove() const {
  for (const fs::path& file : FilesOfParts(all_)) RemoveTree(file);
}

}  // namespace dtr::sfm
