#include "dtr/base/text_rows.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/text_file.h"

namespace dtr {
namespace {

constexpr std::string_view kBlanks = " \t";
constexpr char kAnyBlanks = ' ';

std::string_view Trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

// Takes the next line, without its end, from `text` at `position`.
bool TakeLine(std::string_view text, size_t& position, std::string_view& line) {
  if (position >= text.size()) return false;
  const size_t end = std::min(text.find('\n', position), text.size());
  line = text.substr(position, end - position);
  position = end + 1;
  return true;
}

std::vector<std::string> WordsOf(std::string_view line) {
  std::vector<std::string> words;
  for (size_t at = line.find_first_not_of(kBlanks); at < line.size();
       at = line.find_first_not_of(kBlanks, at)) {
    const size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.emplace_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

std::string Shown(const std::string& cell) {
  constexpr size_t kMaxShown = 40;
  return cell.empty() ? "an empty cell" : "'" + Printable(cell.substr(0, kMaxShown)) + "'";
}

}  // namespace

char SeparatorOf(std::string_view line) {
  bool quoted = false, semicolon = false, comma = false, tab = false, tab_behind_comma = false;
  char before = '\0';  // the last character that is no blank
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (!quoted) {
      semicolon |= c == ';';
      comma |= c == ',';
      tab |= c == '\t';
      tab_behind_comma |= c == '\t' && before == ',';
    }
    if (kBlanks.find(c) == std::string_view::npos) before = c;
  }
  if (semicolon) return ';';
  if (tab && !tab_behind_comma) return '\t';
  return comma ? ',' : kAnyBlanks;
}

std::vector<std::string> CellsOf(std::string_view line, char separator) {
  if (separator == kAnyBlanks) {
    if (line.find('"') == std::string_view::npos) return WordsOf(line);
    line = Trimmed(line);
  }
  std::vector<std::string> cells{""};
  bool quoted = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back().push_back(line[++i]);
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && (c == separator || (separator == kAnyBlanks && c == '\t'))) {
      const bool between_blanks = separator == kAnyBlanks && cells.back().empty();
      if (!between_blanks) cells.emplace_back();
    } else {
      cells.back().push_back(c);
    }
  }
  for (std::string& cell : cells) cell = std::string(Trimmed(cell));
  return cells;
}

TextRows::TextRows(std::string text, std::string source)
    : text_(std::move(text)), source_(std::move(source)) {}

bool TextRows::NextLine(std::string_view& line) {
  if (!TakeLine(text_, position_, line)) return false;
  ++line_;
  return true;
}

bool TextRows::Next() {
  std::string_view line;
  while (NextLine(line)) {
    const std::string_view words = Trimmed(line);
    if (words.empty() || words.front() == '#') continue;
    cells_ = CellsOf(line, separator_.value_or(SeparatorOf(line)));
    return true;
  }
  return false;
}

void TextRows::ExpectCells(size_t count, const char* what) const {
  if (cells_.size() == count) return;
  throw Error(Where() + "expected " + std::to_string(count) + " cells in a row, " + what +
              ", found " + std::to_string(cells_.size()) +
              "; each row must be whole, with numbers that have a decimal point");
}

double TextRows::Number(size_t cell, const char* what) const {
  const std::string found = cell < cells_.size() ? cells_[cell] : "";
  if (const auto number = FiniteNumber(found)) return *number;
  throw Error(Where() + what + ": expected a finite number, found " + Shown(found) +
              DecimalCommaHint(found));
}

std::string TextRows::Where() const { return source_ + ":" + std::to_string(line_) + ": "; }

std::vector<std::string> ColumnNames(std::string_view line) {
  line = Trimmed(line);
  while (line.starts_with('#')) line.remove_prefix(1);
  std::vector<std::string> names = CellsOf(line, SeparatorOf(line));
  for (std::string& name : names) {
    name = LowerCase(name.substr(0, name.find_first_of(kBlanks)));
  }
  return names;
}

TextTable::TextTable(std::string text, std::string source, std::string_view skipped)
    : rows_(std::move(text), std::move(source)) {
  std::string_view line;
  while (names_.empty() && rows_.NextLine(line)) {
    const std::string_view words = Trimmed(line);
    if (words.empty() || (!skipped.empty() && words.starts_with(skipped))) continue;
    names_ = ColumnNames(words);
    rows_.SetSeparator(SeparatorOf(words));
  }
  for (size_t i = 0; i < names_.size(); ++i) {
    if (names_[i].empty()) continue;  // behind a separator at the end of the line
    if (!index_.emplace(names_[i], i).second) {
      throw Error(Where() + "the column " + Printable(names_[i]) + " stands twice");
    }
  }
}

bool TextTable::Next() {
  if (!rows_.Next()) return false;
  const std::vector<std::string>& cells = rows_.cells();
  for (size_t i = names_.size(); i < cells.size(); ++i) {
    if (cells[i].empty()) continue;
    throw Error(Where() + "expected " + std::to_string(names_.size()) +
                " columns as the first line has, found " + std::to_string(cells.size()) +
                "; numbers must have a decimal point, and cells with a separator in them quotes");
  }
  return true;
}

std::optional<size_t> TextTable::Find(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    if (const auto found = index_.find(std::string_view(name)); found != index_.end()) {
      return found->second;
    }
  }
  return std::nullopt;
}

size_t TextTable::Column(std::initializer_list<const char*> names) const {
  if (const auto column = Find(names)) return *column;
  std::string all;
  for (const std::string& name : names_) {
    all += (all.empty() ? "" : ", ") + Printable(name);
  }
  throw Error(rows_.source() + ": expected a column " + *names.begin() + ", found " +
              (all.empty() ? "none" : all));
}

const std::string& TextTable::Cell(size_t column) const {
  static const std::string kEmpty;
  return column < rows_.cells().size() ? rows_.cells()[column] : kEmpty;
}

double TextTable::Number(size_t column) const {
  return rows_.Number(column, Printable(names_[column]).c_str());
}

std::string NumbersText(std::string text, const std::string& source) {
  std::string numbers, line_text;
  std::string_view line;
  int line_number = 0;
  for (size_t at = 0; TakeLine(text, at, line);) {
    ++line_number;
    if (!Trimmed(line).starts_with('#')) {
      // Numbers hold no blanks: a tab is one among them.
      const char found = SeparatorOf(line);
      const char separator = found == '\t' ? kAnyBlanks : found;
      for (const std::string& cell : CellsOf(line, separator)) {
        const bool several = separator != kAnyBlanks && cell.find_first_of(kBlanks) != cell.npos;
        if (several || !DecimalCommaHint(cell).empty()) {
          throw Error(source + ":" + std::to_string(line_number) + ": found " + Shown(cell) +
                      " where a number should stand; write numbers with a decimal point, not a "
                      "comma, and with one separator between them");
        }
        numbers += cell + ' ';
      }
    }
    numbers += '\n';
  }
  return numbers;
}

}  // namespace dtr
