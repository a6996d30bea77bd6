#include "capture/contents.h"

#include <algorithm>

namespace dtr::capture {
namespace {

constexpr size_t kNamed = 4;  // folders or extensions named in the line

std::string Count(int number, const std::string& one, const std::string& many) {
  return std::to_string(number) + " " + (number == 1 ? one : many);
}

std::string PlacesOf(const Ignored& ignored) {
  std::string text;
  for (size_t i = 0; i < ignored.where.size() && i < kNamed; ++i) {
    text += (i == 0 ? "" : ", ") + ignored.where[i];
  }
  const size_t more = ignored.where.size() - std::min(ignored.where.size(), kNamed);
  return more == 0 ? text : text + " and " + std::to_string(more) + " more";
}

}  // namespace

void FolderContents::Ignore(const std::string& kind, const std::string& what,
                            const std::string& reason, const std::string& where, int files) {
  auto entry = std::find_if(ignored.begin(), ignored.end(),
                            [&](const Ignored& other) { return other.kind == kind; });
  if (entry == ignored.end()) {
    ignored.push_back({kind, what, reason, 0, {}});
    entry = std::prev(ignored.end());
  }
  entry->files += files;
  const auto at = std::lower_bound(entry->where.begin(), entry->where.end(), where);
  if (!where.empty() && (at == entry->where.end() || *at != where)) entry->where.insert(at, where);
}

void FolderContents::Use(const std::string& kind) {
  std::erase_if(ignored, [&](const Ignored& entry) { return entry.kind == kind; });
}

std::string LineOf(const FolderContents& contents) {
  const bool of_videos = contents.photos == 0 && contents.videos > 0 && contents.cameras > 0;
  std::string line = "found " + (of_videos ? Count(contents.videos, "video", "videos")
                                           : Count(contents.photos, "photo", "photos"));
  if (contents.cameras > 0) line += " of " + Count(contents.cameras, "camera", "cameras");
  if (contents.masks > 0) line += ", " + Count(contents.masks, "mask", "masks");
  const auto is_depth = [](const Ignored& ignored) { return ignored.kind == "depth_maps"; };
  if (contents.depth_maps > 0 &&
      std::none_of(contents.ignored.begin(), contents.ignored.end(), is_depth)) {
    line += ", " + Count(contents.depth_maps, "depth map", "depth maps");
  }
  for (size_t i = 0; i < contents.ignored.size(); ++i) {
    const Ignored& ignored = contents.ignored[i];
    line += (i == 0 ? "; ignored: " : ", ") + ignored.what + " (" + std::to_string(ignored.files);
    const std::string places = PlacesOf(ignored);
    if (!places.empty()) line += ": " + places;
    if (!ignored.reason.empty()) line += "; " + ignored.reason;
    line += ")";
  }
  return line;
}

}  // namespace dtr::capture
