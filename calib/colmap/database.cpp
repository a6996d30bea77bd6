#include "calib/colmap/database.h"

#include <sqlite3.h>

#include <limits>
#include <memory>

#include "dtr/base/error.h"

namespace dtr::colmap {
namespace {

[[noreturn]] void Refuse(const std::filesystem::path& database, const std::string& found) {
  throw Error(database.string() + ": expected a COLMAP database with a table of images, found: " +
              found + "; delete the workspace to make it anew");
}

std::uint32_t IdColumn(const std::filesystem::path& database, sqlite3_stmt* row, int column) {
  const sqlite3_int64 id = sqlite3_column_int64(row, column);
  if (id < 1 || id > std::numeric_limits<std::uint32_t>::max()) {
    Refuse(database, "the id " + std::to_string(id));
  }
  return static_cast<std::uint32_t>(id);
}

}  // namespace

std::map<std::string, DatabaseIds> ReadDatabaseIds(const std::filesystem::path& database) {
  // A handle is made, and wants closing, even when opening fails.
  sqlite3* opened = nullptr;
  const int failure = sqlite3_open_v2(database.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
  const std::unique_ptr<sqlite3, decltype(&sqlite3_close)> handle(opened, &sqlite3_close);
  if (failure != SQLITE_OK) Refuse(database, sqlite3_errstr(failure));

  sqlite3_stmt* prepared = nullptr;
  constexpr char kQuery[] = "SELECT name, image_id, camera_id FROM images";
  if (sqlite3_prepare_v2(opened, kQuery, -1, &prepared, nullptr) != SQLITE_OK) {
    Refuse(database, sqlite3_errmsg(opened));
  }
  const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement(prepared,
                                                                             &sqlite3_finalize);
  std::map<std::string, DatabaseIds> images;
  int step = SQLITE_ROW;
  while ((step = sqlite3_step(prepared)) == SQLITE_ROW) {
    const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(prepared, 0));
    if (name == nullptr) Refuse(database, "an image without a name");
    images[name] = {IdColumn(database, prepared, 1), IdColumn(database, prepared, 2)};
  }
  if (step != SQLITE_DONE) Refuse(database, sqlite3_errmsg(opened));
  return images;
}

}  // namespace dtr::colmap
