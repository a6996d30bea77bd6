// dtr/base/text_rows.h -- rows and cells of text: tables with or without names of columns,
// whatever separates them.
#pragma once
#include <cstddef>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dtr {

/// What stands between the cells of a line: ';', a tab or ',', the first of them that stands in it
/// outside quotes; else ' ', for any number of blanks.
char SeparatorOf(std::string_view line);

/// Cells of a line without blanks around them; empty ones are cells, but between blanks. Within
/// double quotes a separator is text, and two quotes are one.
std::vector<std::string> CellsOf(std::string_view line, char separator);

/// Goes through the rows of a text (TextOf). Empty lines and comments, which begin with '#', are no
/// rows. Every error is an Error "source:line: ...".
class TextRows {
 public:
  TextRows(std::string text, std::string source);

  /// To the next row, or the first; false at the end. Without a separator that is set each row has
  /// its own (SeparatorOf).
  bool Next();
  /// The same, comments and all, for lines that are no rows; false at the end.
  bool NextLine(std::string_view& line);
  void SetSeparator(char separator) { separator_ = separator; }

  const std::vector<std::string>& cells() const { return cells_; }
  /// Throws unless the row has so many cells.
  void ExpectCells(size_t count, const char* what) const;
  /// A cell that is a finite number. Throws where it is none, or the row ends before it.
  double Number(size_t cell, const char* what) const;

  int line() const { return line_; }  ///< of the row, from 1
  /// "source:line: " of the row.
  std::string Where() const;
  const std::string& source() const { return source_; }

 private:
  std::string text_, source_;
  size_t position_ = 0;
  int line_ = 0;
  std::optional<char> separator_;
  std::vector<std::string> cells_;
};

/// Names of columns out of the first line of a table: in lower case, without '#' before the first
/// and what stands behind a blank in them ("k1 (radial)").
std::vector<std::string> ColumnNames(std::string_view line);

/// A table whose first line names the columns (ColumnNames), in any order. Rows may end before
/// their last columns: those are empty. More cells than columns are an error.
class TextTable {
 public:
  /// Reads the names. Lines before them that begin with `skipped` are passed over. Throws Error
  /// where a name stands twice.
  TextTable(std::string text, std::string source, std::string_view skipped = {});

  /// To the next row; false at the end.
  bool Next();
  /// The column of the first of these names that is there.
  std::optional<size_t> Find(std::initializer_list<const char*> names) const;
  /// Find, but throws Error where there is none.
  size_t Column(std::initializer_list<const char*> names) const;
  /// Of the row; empty where it ends before.
  const std::string& Cell(size_t column) const;
  /// Throws Error naming the column where the cell is no finite number.
  double Number(size_t column) const;

  int line() const { return rows_.line(); }  ///< of the row, from 1
  std::string Where() const { return rows_.Where(); }

 private:
  TextRows rows_;
  std::vector<std::string> names_;
  std::map<std::string, size_t, std::less<>> index_;
};

/// The numbers of a small file, words between blanks: lines that begin with '#' are left out, and
/// cells of a line may stand between commas, semicolons or tabs. Lines stay lines. Throws Error
/// where a number has a decimal comma.
std::string NumbersText(std::string text, const std::string& source);

}  // namespace dtr
