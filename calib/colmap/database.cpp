#include "calib/colmap/database.h"

#include <sqlite3.h>

#include <limits>
#include <memory>

#include "calib/colmap/workspace.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace {

/// COLMAP numbers a pair by kPairBase * the lower image id + the higher one.
constexpr sqlite3_int64 kPairBase = 2147483647;

[[noreturn]] void Refuse(const std::filesystem::path& database, const std::string& found) {
  throw Error(database.string() + ": expected a COLMAP database with a table of images, found: " +
              found + "; delete the workspace to make it anew");
}

/// A database that is only read; what cannot be read is refused by its name.
class Database {
 public:
  explicit Database(const std::filesystem::path& file) : file_(file) {
    // A handle is made, and wants closing, even when opening fails.
    sqlite3* opened = nullptr;
    const int failure = sqlite3_open_v2(file.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
    handle_.reset(opened);
    if (failure != SQLITE_OK) Refuse(file, sqlite3_errstr(failure));
  }

  /// Calls `on_row` with every row that the query finds.
  template <typename OnRow>
  void ForEachRow(const char* query, const OnRow& on_row) const {
    sqlite3_stmt* prepared = nullptr;
    if (sqlite3_prepare_v2(handle_.get(), query, -1, &prepared, nullptr) != SQLITE_OK) {
      Refuse(file_, sqlite3_errmsg(handle_.get()));
    }
    const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement(prepared,
                                                                               &sqlite3_finalize);
    int step = SQLITE_ROW;
    while ((step = sqlite3_step(prepared)) == SQLITE_ROW) on_row(prepared);
    if (step != SQLITE_DONE) Refuse(file_, sqlite3_errmsg(handle_.get()));
  }

  std::uint32_t Id(sqlite3_int64 id) const {
    if (id < 1 || id > std::numeric_limits<std::uint32_t>::max()) {
      Refuse(file_, "the id " + std::to_string(id));
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
    if (name == nullptr) Refuse(database, "an image without a name");
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
