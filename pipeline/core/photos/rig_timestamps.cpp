#include "pipeline/core/photos/rig_timestamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"

namespace dtr::pipeline {
namespace {

constexpr std::uintmax_t kLargestTableBytes = 64u << 20;

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

class Table {
 public:
  explicit Table(const std::filesystem::path& file)
      : source_(file.string()),
        rows_(ReadTextFile(file, kLargestTableBytes), source_),
        time_step_(rows_.Column({"sync_index"})),
        camera_(rows_.Column({"cam_id"})),
        frame_(rows_.Find({"frame_index"})),
        time_(rows_.Find({"frame_time"})) {}

  bool counts_frames() const { return frame_.has_value(); }

  // False at the end. `row` is empty where the line says that the camera has no frame.
  bool Next(std::optional<Row>& row) {
    if (!rows_.Next()) return false;
    row = Row{Number(time_step_, "sync_index"), Number(camera_, "cam_id"), {}};
    const auto& presence = frame_ ? frame_ : time_;
    if (presence && IsMissing(rows_.Cell(*presence))) {
      row.reset();
    } else if (frame_) {
      row->frame = Number(*frame_, "frame_index");
    }
    return true;
  }

 private:
  int Number(size_t column, const char* name) const {
    if (const auto value = NumberOf(rows_.Cell(column))) return *value;
    throw Error(
        fmt::format("{}: line {}: {}: expected a whole number", source_, rows_.line(), name));
  }

  std::string source_;
  TextTable rows_;
  size_t time_step_, camera_;
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
  Table table(file);
  std::vector<Row> rows;
  for (std::optional<Row> row; table.Next(row);) {
    if (row) rows.push_back(*row);
  }
  RigTimestamps timestamps;
  timestamps.counted = !table.counts_frames();
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
