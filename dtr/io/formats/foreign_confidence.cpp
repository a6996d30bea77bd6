#include "dtr/io/formats/foreign_confidence.h"

#include <algorithm>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/lzfse.h"
#include "dtr/io/stored_bytes.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxConfidencePx = 16 << 20;  // depth of phones has some hundred thousand

/// Confidence of all pixels, row by row.
struct Confidence {
  int width = 0;  ///< 0: the file does not say
  std::vector<std::uint8_t> levels;
};

Confidence ReadConfidence(const fs::path& file) {
  if (file.extension() == ".conf") {
    const std::string bytes =
        DecodeLzfse(ReadFile(file, 2 * kMaxConfidencePx), kMaxConfidencePx, file.string());
    return {0, {bytes.begin(), bytes.end()}};
  }
  const Grid<std::uint8_t> levels = ReadStoredBytes(file, kMaxConfidencePx);
  return {levels.width(), {levels.data().begin(), levels.data().end()}};
}

}  // namespace

fs::path ConfidenceMaps::FileOf(const fs::path& depth_file) const {
  if (folder.empty()) return {};
  std::string name = depth_file.filename().replace_extension(extension).string();
  if (name.starts_with(prefix.first)) name.replace(0, prefix.first.size(), prefix.second);
  const fs::path file = folder / name;
  std::error_code ignored;
  return fs::is_regular_file(file, ignored) ? file : fs::path();
}

double LowConfidenceShare(const fs::path& confidence_file) {
  const Confidence confidence = ReadConfidence(confidence_file);
  if (confidence.levels.empty()) return 0;
  const auto low = std::count(confidence.levels.begin(), confidence.levels.end(), 0);
  return static_cast<double>(low) / static_cast<double>(confidence.levels.size());
}

void LeaveOutLowConfidence(const fs::path& confidence_file, DepthImage& depth) {
  const Confidence confidence = ReadConfidence(confidence_file);
  auto& numbers = depth.grid().data();
  if (confidence.levels.size() != numbers.size() ||
      (confidence.width > 0 && confidence.width != depth.width())) {
    throw Error(confidence_file.string() + ": expected a confidence map of the depth map's " +
                std::to_string(depth.width()) + "x" + std::to_string(depth.height()) +
                " pixels, found " + std::to_string(confidence.levels.size()) +
                " pixels; export both again, or take it away");
  }
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (confidence.levels[i] == 0) numbers[i] = 0;
  }
}

}  // namespace dtr::io
