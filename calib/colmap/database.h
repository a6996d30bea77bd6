// calib/colmap/database.h -- the little we read from COLMAP's SQLite database.
#pragma once
#include <cstdint>
#include <filesystem>
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
/// and its older versions refuse a model with other numbers.
/// Throws Error when the file is no COLMAP database.
std::map<std::string, DatabaseIds> ReadDatabaseIds(const std::filesystem::path& database);

/// Features that two images have in common: matches that agree with one geometry of the pair.
struct DatabasePair {
  std::uint32_t image_ids[2];
  std::int64_t common;
};

/// What a database says of images by their ids.
struct DatabaseMatches {
  std::map<std::uint32_t, std::int64_t> features;  ///< number found in each image
  std::vector<DatabasePair> pairs;                 ///< that have anything in common
};

/// Throws Error when the file is no COLMAP database.
DatabaseMatches ReadDatabaseMatches(const std::filesystem::path& database);

}  // namespace dtr::colmap
