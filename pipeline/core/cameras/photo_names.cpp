#include "pipeline/core/cameras/photo_names.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "capture/ingest.h"
#include "dtr/base/lower_case.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

std::string WithSlashes(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  return path;
}

std::string BaseOf(const std::string& path) {
  const size_t slash = path.rfind('/');
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

// The extension of an image, or nothing: of the label "IMG.0001" ".0001" is none.
std::string ImageExtension(const std::string& base) {
  const std::string extension = fs::path(base).extension().string();
  return capture::IsImageExtension(extension) ? extension : "";
}

std::string WithoutExtension(const std::string& base) {
  return base.substr(0, base.size() - ImageExtension(base).size());
}

// How many folders, from the last one up, two paths have in common; empty where they contradict
// each other, which is where both go on after that.
std::optional<size_t> CommonFolders(const std::string& a, const std::string& b) {
  size_t common = 0;
  fs::path x = fs::path(a).parent_path(), y = fs::path(b).parent_path();
  while (!x.filename().empty() && !y.filename().empty()) {
    if (x.filename() != y.filename()) return std::nullopt;
    ++common;
    x = x.parent_path();
    y = y.parent_path();
  }
  return common;
}

}  // namespace

PhotoNames::PhotoNames(std::vector<std::string> names) : names_(std::move(names)) {
  std::sort(names_.begin(), names_.end());
  for (size_t i = 0; i < names_.size(); ++i) {
    by_base_.emplace(LowerCase(WithoutExtension(BaseOf(names_[i]))), i);
  }
}

std::vector<std::string> PhotoNames::Meant(const std::string& given) const {
  std::string path = WithSlashes(given);
  while (path.starts_with("./")) path.erase(0, 2);
  const std::string base = BaseOf(path);
  const std::string extension = ImageExtension(base), stem = WithoutExtension(base);
  // The best agreement of extension and name, then of the folders; more is better.
  std::pair<int, size_t> best{0, 0};
  std::vector<std::string> meant;
  const auto [first, last] = by_base_.equal_range(LowerCase(stem));
  for (auto entry = first; entry != last; ++entry) {
    const std::string& name = names_[entry->second];
    if (name == path) return {name};
    const std::string other = BaseOf(name);
    int agreement = 0;
    if (other == base) {
      agreement = 4;
    } else if (LowerCase(other) == LowerCase(base)) {
      agreement = 3;
    } else if (extension.empty()) {
      agreement = WithoutExtension(other) == stem ? 2 : 1;
    } else {
      continue;
    }
    const std::optional<size_t> folders = CommonFolders(path, name);
    if (!folders) continue;
    const std::pair<int, size_t> rank{agreement, *folders};
    if (rank < best) continue;
    if (best < rank) meant.clear();
    best = rank;
    meant.push_back(name);
  }
  return meant;
}

}  // namespace dtr::pipeline
