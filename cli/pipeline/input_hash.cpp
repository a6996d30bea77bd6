#include "cli/pipeline/input_hash.h"

#include <algorithm>
#include <span>
#include <vector>

#include "dtr/base/hash.h"

namespace dtr::pipeline {

namespace fs = std::filesystem;

std::string InputHash(const fs::path& input) {
  if (input.empty()) return "";
  if (!fs::is_directory(input)) return Sha256OfFile(input);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(input)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::string all;
  for (const fs::path& file : files) {
    all += file.lexically_relative(input).generic_string() + Sha256OfFile(file);
  }
  return Sha256(std::as_bytes(std::span(all)));
}

}  // namespace dtr::pipeline
