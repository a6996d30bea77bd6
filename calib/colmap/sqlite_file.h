// calib/colmap/sqlite_file.h -- a COLMAP database as an SQLite file. For calib/colmap alone.
#pragma once
#include <sqlite3.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>

#include "dtr/base/error.h"

namespace dtr::colmap {

/// COLMAP numbers a pair by kPairBase * the lower image id + the higher one.
inline constexpr sqlite3_int64 kPairBase = 2147483647;

[[noreturn]] inline void RejectDatabase(const std::filesystem::path& database,
                                        const std::string& found) {
  throw Error(database.string() + ": expected a COLMAP database with a table of images, found: " +
              found + "; delete the workspace to start again");
}

/// A database that is only read; what cannot be read is rejected by its name.
class ReadOnlyDatabase {
 public:
  explicit ReadOnlyDatabase(const std::filesystem::path& file) : file_(file) {
    // A handle is made, and wants closing, even when opening fails.
    sqlite3* opened = nullptr;
    const int failure = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
    handle_.reset(opened);
    if (failure != SQLITE_OK) RejectDatabase(file, sqlite3_errstr(failure));
    RejectIfCutShort();
  }

  /// Calls `on_row` with every row that the query finds.
  template <typename OnRow>
  void ForEachRow(const char* query, const OnRow& on_row) const {
    sqlite3_stmt* prepared = nullptr;
    if (sqlite3_prepare_v2(handle_.get(), query, -1, &prepared, nullptr) != SQLITE_OK) {
      RejectDatabase(file_, sqlite3_errmsg(handle_.get()));
    }
    const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement(prepared,
                                                                               &sqlite3_finalize);
    int step = SQLITE_ROW;
    while ((step = sqlite3_step(prepared)) == SQLITE_ROW) on_row(prepared);
    if (step != SQLITE_DONE) RejectDatabase(file_, sqlite3_errmsg(handle_.get()));
  }

  /// A matrix as COLMAP stores it, row by row; valid until the next row is read.
  template <typename Number>
  struct View {
    const unsigned char* data = nullptr;
    size_t rows = 0, cols = 0;
    Number At(size_t row, size_t col) const {
      Number number;
      std::memcpy(&number, data + (row * cols + col) * sizeof(Number), sizeof(Number));
      return number;
    }
  };

  /// Of the columns `first` (number of rows), `first` + 1 (of columns) and `first` + 2 (numbers).
  template <typename Number>
  View<Number> Matrix(sqlite3_stmt* row, int first, sqlite3_int64 min_cols) const {
    constexpr sqlite3_int64 kMaxCols = 1024;
    const sqlite3_int64 rows = sqlite3_column_int64(row, first);
    const sqlite3_int64 cols = sqlite3_column_int64(row, first + 1);
    const auto* data = static_cast<const unsigned char*>(sqlite3_column_blob(row, first + 2));
    const sqlite3_int64 bytes = sqlite3_column_bytes(row, first + 2);
    constexpr auto kSize = static_cast<sqlite3_int64>(sizeof(Number));
    if (rows < 0 || (rows > 0 && (cols < min_cols || cols > kMaxCols ||
                                  bytes % (kSize * cols) != 0 || bytes / (kSize * cols) != rows))) {
      RejectDatabase(file_, "a matrix of " + std::to_string(rows) + " x " + std::to_string(cols) +
                                " in " + std::to_string(bytes) + " bytes");
    }
    return {data, static_cast<size_t>(rows), static_cast<size_t>(cols)};
  }

  std::uint32_t Id(sqlite3_int64 id) const {
    if (id < 1 || id > std::numeric_limits<std::uint32_t>::max()) {
      RejectDatabase(file_, "the id " + std::to_string(id));
    }
    return static_cast<std::uint32_t>(id);
  }

 private:
  // SQLite reads zeros in the place of a last page that is cut short.
  void RejectIfCutShort() const {
    if (std::filesystem::exists(file_.string() + "-wal")) return;  // pages are there, too
    sqlite3_int64 pages = 0, page_bytes = 0;
    ForEachRow("PRAGMA page_count",
               [&](sqlite3_stmt* row) { pages = sqlite3_column_int64(row, 0); });
    ForEachRow("PRAGMA page_size",
               [&](sqlite3_stmt* row) { page_bytes = sqlite3_column_int64(row, 0); });
    const auto bytes = static_cast<sqlite3_int64>(std::filesystem::file_size(file_));
    if (bytes % page_bytes != 0 || bytes / page_bytes < pages) {
      RejectDatabase(file_, "a file cut short after " + std::to_string(bytes) + " bytes");
    }
  }

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> handle_{nullptr, &sqlite3_close};
};

}  // namespace dtr::colmap
