#include "calib/colmap/database.h"

#include <sqlite3.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "calib/colmap/workspace.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace {

/// COLMAP numbers a pair by kPairBase * the lower image id + the higher one.
constexpr sqlite3_int64 kPairBase = 2147483647;

[[noreturn]] void Reject(const std::filesystem::path& database, const std::string& found) {
  throw Error(database.string() + ": expected a COLMAP database with a table of images, found: " +
              found + "; delete the workspace to start again");
}

/// A database that is only read; what cannot be read is rejected by its name.
class Database {
 public:
  explicit Database(const std::filesystem::path& file) : file_(file) {
    // A handle is made, and wants closing, even when opening fails.
    sqlite3* opened = nullptr;
    const int failure = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
    handle_.reset(opened);
    if (failure != SQLITE_OK) Reject(file, sqlite3_errstr(failure));
  }

  /// Calls `on_row` with every row that the query finds.
  template <typename OnRow>
  void ForEachRow(const char* query, const OnRow& on_row) const {
    sqlite3_stmt* prepared = nullptr;
    if (sqlite3_prepare_v2(handle_.get(), query, -1, &prepared, nullptr) != SQLITE_OK) {
      Reject(file_, sqlite3_errmsg(handle_.get()));
    }
    const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement(prepared,
                                                                               &sqlite3_finalize);
    int step = SQLITE_ROW;
    while ((step = sqlite3_step(prepared)) == SQLITE_ROW) on_row(prepared);
    if (step != SQLITE_DONE) Reject(file_, sqlite3_errmsg(handle_.get()));
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
      Reject(file_, "a matrix of " + std::to_string(rows) + " x " + std::to_string(cols) + " in " +
                        std::to_string(bytes) + " bytes");
    }
    return {data, static_cast<size_t>(rows), static_cast<size_t>(cols)};
  }

  std::uint32_t Id(sqlite3_int64 id) const {
    if (id < 1 || id > std::numeric_limits<std::uint32_t>::max()) {
      Reject(file_, "the id " + std::to_string(id));
    }
    return static_cast<std::uint32_t>(id);
  }

 private:
  std::filesystem::path file_;
  std::unique_ptr<sqlite3, decltype(&sqlite3_close)> handle_{nullptr, &sqlite3_close};
};

// Whoever closes a database last takes its log into it, and COLMAP does; where it did not, this
// does: one file alone can be moved at once.
void FoldLogIn(const std::filesystem::path& database) {
  if (!std::filesystem::exists(database.string() + "-wal")) return;
  sqlite3* opened = nullptr;
  int failure = sqlite3_open_v2(database.c_str(), &opened, SQLITE_OPEN_READWRITE, nullptr);
  const std::unique_ptr<sqlite3, decltype(&sqlite3_close)> closing(opened, &sqlite3_close);
  if (failure == SQLITE_OK) {
    failure = sqlite3_exec(opened, "PRAGMA wal_checkpoint(TRUNCATE)", nullptr, nullptr, nullptr);
  }
  if (failure == SQLITE_OK) return;
  throw Error(database.string() + ": its log cannot be taken into it: " + sqlite3_errstr(failure) +
              "; the same command goes on with the photos before");
}

}  // namespace

std::map<std::string, DatabaseIds> ReadDatabaseIds(const std::filesystem::path& database) {
  const Database opened(database);
  std::map<std::string, DatabaseIds> images;
  opened.ForEachRow("SELECT name, image_id, camera_id FROM images", [&](sqlite3_stmt* row) {
    const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
    if (name == nullptr) Reject(database, "an image without a name");
    images[name] = {opened.Id(sqlite3_column_int64(row, 1)),
                    opened.Id(sqlite3_column_int64(row, 2))};
  });
  return images;
}

DatabaseMatches ReadDatabaseMatches(const std::filesystem::path& database) {
  const Database opened(database);
  DatabaseMatches found;
  opened.ForEachRow("SELECT image_id, rows FROM keypoints", [&](sqlite3_stmt* row) {
    found.features[opened.Id(sqlite3_column_int64(row, 0))] = sqlite3_column_int64(row, 1);
  });
  opened.ForEachRow(
      "SELECT pair_id, rows FROM two_view_geometries WHERE rows > 0", [&](sqlite3_stmt* row) {
        const sqlite3_int64 pair = sqlite3_column_int64(row, 0);
        found.pairs.push_back({{opened.Id(pair / kPairBase), opened.Id(pair % kPairBase)},
                               sqlite3_column_int64(row, 1)});
      });
  return found;
}

void ForEachMatchedPair(const std::filesystem::path& database,
                        const std::function<void(const MatchedPair&)>& use) {
  const Database opened(database);
  std::map<std::uint32_t, std::vector<std::array<float, 2>>> features;
  opened.ForEachRow("SELECT image_id, rows, cols, data FROM keypoints", [&](sqlite3_stmt* row) {
    const auto values = opened.Matrix<float>(row, 1, 2);
    auto& of_image = features[opened.Id(sqlite3_column_int64(row, 0))];
    for (size_t i = 0; i < values.rows; ++i) {
      of_image.push_back({values.At(i, 0), values.At(i, 1)});
    }
  });
  opened.ForEachRow(
      "SELECT pair_id, rows, cols, data, config FROM two_view_geometries WHERE rows > 0",
      [&](sqlite3_stmt* row) {
        const sqlite3_int64 id = sqlite3_column_int64(row, 0);
        MatchedPair pair{
            {opened.Id(id / kPairBase), opened.Id(id % kPairBase)}, sqlite3_column_int(row, 4), {}};
        const auto matches = opened.Matrix<std::uint32_t>(row, 1, 2);
        const auto &a = features[pair.image_ids[0]], &b = features[pair.image_ids[1]];
        for (size_t i = 0; i < matches.rows; ++i) {
          const std::uint32_t in_a = matches.At(i, 0), in_b = matches.At(i, 1);
          if (in_a >= a.size() || in_b >= b.size()) {
            Reject(database, "a match of a feature that its image lacks");
          }
          pair.moved_px.push_back(std::hypot(a[in_a][0] - b[in_b][0], a[in_a][1] - b[in_b][1]));
        }
        use(pair);
      });
}

void RemoveDatabase(const std::filesystem::path& database) {
  for (const char* part : {"", "-wal", "-shm", "-journal"}) RemoveAll(database.string() + part);
}

void CopyDatabase(const std::filesystem::path& from, const std::filesystem::path& to) {
  RemoveDatabase(to);
  for (const char* part : {"", "-wal"}) {
    if (*part != '\0' && !std::filesystem::exists(from.string() + part)) continue;
    std::error_code failure;
    std::filesystem::copy_file(from.string() + part, to.string() + part, failure);
    if (failure) throw Error(to.string() + part + ": cannot be written: " + failure.message());
  }
}

void MoveDatabase(const std::filesystem::path& from, const std::filesystem::path& to) {
  FoldLogIn(from);
  SyncFile(from);
  Rename(from, to);
  SyncFolder(to.parent_path());
}

}  // namespace dtr::colmap
