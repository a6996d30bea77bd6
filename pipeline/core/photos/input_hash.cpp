#include "pipeline/core/photos/input_hash.h"

#include <algorithm>
#include <vector>

#include "capture/ingest.h"
#include "dtr/base/hash.h"

namespace dtr::pipeline {

namespace fs = std::filesystem;

namespace {

std::string HashOf(std::span<const fs::path> files, const fs::path& below) {
  std::string all;
  for (const fs::path& file : files) {
    all += file.lexically_relative(below).generic_string() + Sha256OfFile(file);
  }
  return Sha256(std::as_bytes(std::span(all)));
}

}  // namespace

std::string InputHash(const fs::path& input) {
  if (input.empty()) return "";
  if (!fs::is_directory(input)) return Sha256OfFile(input);
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator entry(input), end; entry != end; ++entry) {
    if (entry->is_regular_file()) {
      files.push_back(entry->path());
    } else if (entry->is_directory() && capture::IsOwnFolder(entry->path())) {
      entry.disable_recursion_pending();
    }
  }
  std::sort(files.begin(), files.end());
  return HashOf(files, input);
}

std::string InputHash(std::span<const fs::path> files) {
  return files.empty() ? "" : HashOf(files, files.front().parent_path());
}

}  // namespace dtr::pipeline
