#include "pipeline/detail/boards/rig_timestamps.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <sstream>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::pipeline {
namespace {

constexpr std::uintmax_t kLargestTableBytes = 64u << 20;
constexpr const char* kByteOrderMark = "\xEF\xBB\xBF";

std::string Trimmed(const std::string& word) {
  constexpr const char* kSpace = " \t\r";
  const size_t first = word.find_first_not_of(kSpace);
  if (first == std::string::npos) return "";
  return word.substr(first, word.find_last_not_of(kSpace) - first + 1);
}

// Cells of a line; within quotes a separator is text, and two quotes are one.
std::vector<std::string> CellsOf(const std::string& line, char separator) {
  std::vector<std::string> cells{""};
  bool quoted = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back().push_back(line[++i]);
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == separator && !quoted) {
      cells.emplace_back();
    } else {
      cells.back().push_back(c);
    }
  }
  std::transform(cells.begin(), cells.end(), cells.begin(), Trimmed);
  return cells;
}

char SeparatorOf(const std::string& heading) {
  for (const char c : {',', ';', '\t'}) {
    if (heading.find(c) != std::string::npos) return c;
  }
  return ',';
}

// A whole number, or one as data frames write it where a column has gaps: 26.0.
std::optional<int> NumberOf(const std::string& cell) {
  const size_t point = cell.find('.');
  if (point == std::string::npos) return WholeNumber(cell);
  if (cell.find_first_not_of('0', point + 1) != std::string::npos) return {};
  return WholeNumber(cell.substr(0, point));
}

bool IsMissing(std::string cell) {
  for (char& c : cell) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return cell.empty() || cell == "nan";
}

struct Row {
  int time_step = 0, camera = 0;
  std::optional<int> frame;  // empty where the table has no such column
};

// Names of columns, for a message of one line.
std::string Listed(const std::vector<std::string>& names) {
  if (names == std::vector<std::string>{""}) return "none";
  std::string text = fmt::format("{}", fmt::join(names, ", "));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  }
  return text;
}

class Table {
 public:
  Table(std::string file, const std::string& heading)
      : file_(std::move(file)), separator_(SeparatorOf(heading)) {
    names_ = CellsOf(heading, separator_);
    time_step_ = Require("sync_index");
    camera_ = Require("cam_id");
    frame_ = Find("frame_index");
    time_ = Find("frame_time");
  }

  bool counts_frames() const { return frame_.has_value(); }

  // Empty where the line says that the camera has no frame.
  std::optional<Row> RowOf(const std::string& line, int number) const {
    const std::vector<std::string> cells = CellsOf(line, separator_);
    const auto cell = [&](size_t at) { return at < cells.size() ? cells[at] : std::string(); };
    Row row{Number(cell(time_step_), number, "sync_index"),
            Number(cell(camera_), number, "cam_id"),
            {}};
    const auto& presence = frame_ ? frame_ : time_;
    if (presence && IsMissing(cell(*presence))) return std::nullopt;
    if (frame_) row.frame = Number(cell(*frame_), number, "frame_index");
    return row;
  }

 private:
  std::optional<size_t> Find(const std::string& name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) return std::nullopt;
    return static_cast<size_t>(found - names_.begin());
  }

  size_t Require(const std::string& name) const {
    if (const auto at = Find(name)) return *at;
    throw Error(fmt::format("{}: expected a column {}, found {}", file_, name, Listed(names_)));
  }

  int Number(const std::string& cell, int line, const char* column) const {
    if (const auto value = NumberOf(cell)) return *value;
    throw Error(fmt::format("{}: line {}: {}: expected a whole number", file_, line, column));
  }

  std::string file_;
  char separator_;
  std::vector<std::string> names_;
  size_t time_step_ = 0, camera_ = 0;
  std::optional<size_t> frame_, time_;
};

// A table without frame numbers: a camera's rows, in order of time, are its frames.
void CountFrames(std::vector<Row>& rows) {
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.time_step < b.time_step; });
  std::map<int, int> next;
  for (Row& row : rows) row.frame = next[row.camera]++;
}

}  // namespace

std::optional<int> WholeNumber(const std::string& word) {
  int value = 0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failure != std::errc() || end != word.data() + word.size() || value < 0) return {};
  return value;
}

RigTimestamps ReadRigTimestamps(const std::filesystem::path& file) {
  std::string text = ReadFile(file, kLargestTableBytes);
  if (text.starts_with(kByteOrderMark)) text.erase(0, 3);
  std::istringstream lines(text);
  std::optional<Table> table;
  std::vector<Row> rows;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (Trimmed(line).empty()) continue;
    if (!table) {
      table.emplace(file.string(), Trimmed(line));
    } else if (const auto row = table->RowOf(line, number)) {
      rows.push_back(*row);
    }
  }
  if (!table) table.emplace(file.string(), "");  // an empty file has no columns
  RigTimestamps timestamps;
  timestamps.counted = !table->counts_frames();
  if (timestamps.counted) CountFrames(rows);
  for (const Row& row : rows) {
    const auto [at, fresh] =
        timestamps.time_steps.emplace(std::pair(row.camera, *row.frame), row.time_step);
    if (fresh || at->second == row.time_step) continue;
    throw Error(fmt::format(
        "{}: cam_id {}: frame_index {} stands at sync_index {} and at {}; a frame is of one time "
        "step",
        file.string(), row.camera, *row.frame, at->second, row.time_step));
  }
  return timestamps;
}

}  // namespace dtr::pipeline
