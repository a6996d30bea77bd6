#include "calib/colmap/database.h"

#include <array>
#include <cmath>
#include <memory>

#include "calib/colmap/sqlite_file.h"
#include "calib/sfm/run/workspace.h"
#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"

namespace dtr::colmap {
namespace {

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
  const ReadOnlyDatabase opened(database);
  std::map<std::string, DatabaseIds> images;
  opened.ForEachRow("SELECT name, image_id, camera_id FROM images", [&](sqlite3_stmt* row) {
    const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
    if (name == nullptr) RejectDatabase(database, "an image without a name");
    images[name] = {opened.Id(sqlite3_column_int64(row, 1)),
                    opened.Id(sqlite3_column_int64(row, 2))};
  });
  return images;
}

std::map<std::uint32_t, std::int64_t> ReadFeatureCounts(const std::filesystem::path& database) {
  const ReadOnlyDatabase opened(database);
  std::map<std::uint32_t, std::int64_t> counts;
  opened.ForEachRow("SELECT image_id, rows FROM keypoints", [&](sqlite3_stmt* row) {
    counts[opened.Id(sqlite3_column_int64(row, 0))] = sqlite3_column_int64(row, 1);
  });
  return counts;
}

void ForEachMatchedPair(const std::filesystem::path& database,
                        const std::function<void(const MatchedPair&)>& use) {
  const ReadOnlyDatabase opened(database);
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
            RejectDatabase(database, "a match of a feature that its image lacks");
          }
          pair.moved_px.push_back(std::hypot(a[in_a][0] - b[in_b][0], a[in_a][1] - b[in_b][1]));
        }
        use(pair);
      });
}

void RemoveDatabase(const std::filesystem::path& database) {
  for (const char* part : {"", "-wal", "-shm", "-journal"}) RemoveTree(database.string() + part);
}

void CopyDatabase(const std::filesystem::path& from, const std::filesystem::path& to) {
  RemoveDatabase(to);
  for (const char* part : {"", "-wal"}) {
    if (*part != '\0' && !std::filesystem::exists(from.string() + part)) continue;
    CopyFileAtomically(from.string() + part, to.string() + part);
  }
}

void MoveDatabase(const std::filesystem::path& from, const std::filesystem::path& to) {
  FoldLogIn(from);
  SyncFile(from);
  Rename(from, to);
  SyncFolder(to.parent_path());
}

}  // namespace dtr::colmap
