#include "cli/pipeline/rig_timestamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::pipeline {
namespace {

constexpr std::uintmax_t kLargestTableBytes = 64u << 20;
constexpr std::array<const char*, 3> kColumns = {"sync_index", "cam_id", "frame_index"};

std::vector<std::string> WordsOf(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream parts(line);
  for (std::string word; std::getline(parts, word, ',');) words.push_back(word);
  return words;
}

// Where each of kColumns stands in a line.
std::array<size_t, 3> PlacesOf(const std::string& heading, const std::string& file) {
  const std::vector<std::string> words = WordsOf(heading);
  std::array<size_t, 3> places{};
  for (size_t i = 0; i < kColumns.size(); ++i) {
    const auto found = std::find(words.begin(), words.end(), kColumns[i]);
    if (found == words.end()) {
      throw Error(fmt::format("{}: expected a column {}, found none", file, kColumns[i]));
    }
    places[i] = static_cast<size_t>(found - words.begin());
  }
  return places;
}

}  // namespace

std::optional<int> WholeNumber(const std::string& word) {
  int value = 0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failure != std::errc() || end != word.data() + word.size() || value < 0) return {};
  return value;
}

RigInstants ReadRigTimestamps(const std::filesystem::path& file) {
  std::istringstream lines(ReadFile(file, kLargestTableBytes));
  RigInstants instants;
  std::optional<std::array<size_t, 3>> places;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    if (!places) {
      places = PlacesOf(line, file.string());
      continue;
    }
    const std::vector<std::string> words = WordsOf(line);
    std::array<int, 3> values{};
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const size_t at = (*places)[i];
      const auto value = at < words.size() ? WholeNumber(words[at]) : std::nullopt;
      if (!value) {
        throw Error(fmt::format("{}: line {}: {}: expected a whole number", file.string(), number,
                                kColumns[i]));
      }
      values[i] = *value;
    }
    instants[{values[1], values[2]}] = values[0];
  }
  if (!places) PlacesOf("", file.string());  // an empty file has no columns
  return instants;
}

}  // namespace dtr::pipeline
