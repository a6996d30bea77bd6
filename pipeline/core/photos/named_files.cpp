#include "pipeline/core/photos/named_files.h"

#include <algorithm>
#include <set>

#include "capture/ingest.h"
#include "dtr/base/file_names.h"
#include "dtr/io/image_io.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// The folders of a path from the last one up.
std::vector<std::string> PartsFromTheEnd(const fs::path& folder) {
  std::vector<std::string> parts;
  for (const fs::path& part : fs::absolute(folder).lexically_normal()) {
    if (!part.empty() && part != "/") parts.push_back(part.string());
  }
  std::reverse(parts.begin(), parts.end());
  return parts;
}

// `name` without the folders in front of it that the folder ends with; empty: none.
std::string WithoutFolder(const fs::path& folder, const std::string& name) {
  const std::vector<std::string> ends = PartsFromTheEnd(folder);
  std::vector<std::string> leading;
  for (size_t slash = name.find('/'), from = 0; slash != std::string::npos;
       from = slash + 1, slash = name.find('/', from)) {
    leading.insert(leading.begin(), name.substr(from, slash - from));
    if (leading.size() > ends.size()) break;
    if (std::equal(leading.begin(), leading.end(), ends.begin())) return name.substr(slash + 1);
  }
  return "";
}

// A name without an extension is that of the one image called so; empty: there is none, or several.
std::string WithExtension(const fs::path& folder, const std::string& name) {
  std::error_code ignored;
  std::set<std::string> found;
  fs::directory_iterator entries((folder / name).parent_path(), ignored);
  for (; !ignored && entries != fs::directory_iterator(); entries.increment(ignored)) {
    const fs::path& file = entries->path();
    if (file.stem() == fs::path(name).filename() &&
        capture::IsImageExtension(file.extension().string())) {
      found.insert(file.extension().string());
    }
  }
  return found.size() == 1 ? name + *found.begin() : "";
}

}  // namespace

bool IsFile(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored);
}

std::vector<std::string> NamesMeant(const fs::path& folder, const std::string& path) {
  std::vector<std::string> names = {path};
  std::string slashes = path;
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  while (slashes.starts_with("./")) slashes.erase(0, 2);
  if (slashes != path) names.push_back(slashes);
  const std::string bare = WithoutFolder(folder, slashes);
  if (!bare.empty()) names.push_back(bare);
  std::erase_if(names, [](const std::string& name) { return !WhyUnsafeName(name).empty(); });
  return names;
}

std::string NameBelow(const fs::path& folder, const std::string& path) {
  for (const std::string& name : NamesMeant(folder, path)) {
    if (IsFile(folder / name)) return name;
  }
  return path;
}

io::SizedImage SizedImageAt(const fs::path& folder, const std::string& name) {
  const io::ImageHeader header = io::ReadImageHeader(folder / name);
  return {name, header.width_px, header.height_px, header.exif_orientation};
}

std::optional<io::SizedImage> FindImage(const fs::path& folder, const std::string& path) {
  const std::vector<std::string> names = NamesMeant(folder, path);
  for (const std::string& name : names) {
    if (IsFile(folder / name)) return SizedImageAt(folder, name);
  }
  for (const std::string& name : names) {
    const std::string whole = WithExtension(folder, name);
    if (!whole.empty()) return SizedImageAt(folder, whole);
  }
  return std::nullopt;
}

}  // namespace dtr::pipeline
