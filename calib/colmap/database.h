// calib/colmap/database.h -- COLMAP's SQLite database: the little we read from it, and its files.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace dtr::colmap {

/// Ids under which a database knows an image.
struct DatabaseIds {
  std::uint32_t image_id = 0;
  std::uint32_t camera_id = 0;
};

/// The images of a database by name. COLMAP numbers them in the order in which its threads finish,
/// and its older versions reject a model with other numbers.
/// Throws Error when the file is no COLMAP database.
std::map<std::string, DatabaseIds> ReadDatabaseIds(const std::filesystem::path& database);

/// The number of features found in each image, by its id. Throws as ReadDatabaseIds.
std::map<std::uint32_t, std::int64_t> ReadFeatureCounts(const std::filesystem::path& database);

/// A pair of images that COLMAP verified.
struct MatchedPair {
  std::uint32_t image_ids[2];
  int config = 0;                ///< TwoViewGeometry::ConfigurationType
  std::vector<double> moved_px;  ///< per common feature: from its pixel in one image to the other's
};
/// Calls `use` with each pair that has features in common. One pair is in memory at a time, with
/// the positions of all features. Throws Error when the file is no COLMAP database, or a record of
/// it does not fit the others.
void ForEachMatchedPair(const std::filesystem::path& database,
                        const std::function<void(const MatchedPair&)>& use);

/// Of a database that no program has open: removes it with the files that SQLite keeps beside it.
/// Throws Error when it cannot, as do the next two.
void RemoveDatabase(const std::filesystem::path& database);
/// `to` is replaced, and whole only when this returns: something else must vouch for it.
void CopyDatabase(const std::filesystem::path& from, const std::filesystem::path& to);
/// The same, and `from` is gone; what is under the name `to` is on the disk and whole at any
/// moment.
void MoveDatabase(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace dtr::colmap
