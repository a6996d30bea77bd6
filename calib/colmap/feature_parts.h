// calib/colmap/feature_parts.h -- features that several processes found, each in a database of its
// own.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "calib/colmap/workspace.h"
#include "calib/sfm/view_graph.h"
#include "dtr/base/part.h"

namespace dtr::colmap {

/// The note beside a database of features that says how much of it is whole (Workspace::Keep).
std::filesystem::path NoteOf(const std::filesystem::path& database);

/// The database of a part, beside the one of all.
std::filesystem::path PartOf(const std::filesystem::path& database, const Part& part);

/// What lies in databases of parts whose notes have the fingerprint of the step that runs.
class FeatureParts {
 public:
  /// Takes over what the parts cost, too. `database`: the one of all. Throws Error where a database
  /// with such a note is damaged.
  FeatureParts(Workspace& workspace, const std::filesystem::path& database);

  /// Features of an image by its id; nothing where no part has them. Called from any thread.
  std::optional<sfm::Features> Of(std::uint32_t image_id) const;

  /// Removes the databases of all parts, and what else lies beside them.
  void Remove() const;

 private:
  std::filesystem::path database_;
  std::map<std::uint32_t, std::filesystem::path> part_of_;
};

}  // namespace dtr::colmap
