// datasets/list.h -- what data sets there are: scenes that can be made, public sets that can be
// checked.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace dtr::datasets {

/// A data set by name.
struct DatasetInfo {
  std::string name;
  bool is_made_here = false;         ///< true: `dtr dataset make`; false: a public set
  std::string summary;               ///< one line
  std::vector<std::string> layouts;  ///< made here: camera layouts, the default first
  std::string origin;                ///< public: repository @ commit, folder
  std::string licence;               ///< public: as its source states it
  int files = 0;                     ///< public: files with a known checksum
};

/// The scenes, then the public sets by name.
std::vector<DatasetInfo> ListDatasets();

/// What checking a public set on disk found.
struct DatasetCheck {
  std::string name;
  int files_ok = 0;
  std::vector<std::string> missing;  ///< relative paths, sorted
  std::vector<std::string> changed;  ///< there, but with another SHA-256
  bool Ok() const { return missing.empty() && changed.empty(); }
};

/// Compares a copy of a public set in `folder` with the known SHA-256 of each of its files; files
/// that do not belong to the set are passed over. Nothing is downloaded: the checksums are those of
/// the sets as tests expect them (some are subsets or halved images, `origin` says which).
/// Throws UsageError for unknown names and for scenes, Error when the folder is not there, saying
/// where the set comes from.
DatasetCheck CheckPublicSet(const std::string& name, const std::filesystem::path& folder);

}  // namespace dtr::datasets
