// calib/sfm/run/feature_parts.h -- features that several processes found, each in a file of its
// own.
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "calib/sfm/run/store.h"
#include "calib/sfm/run/workspace.h"
#include "dtr/base/part.h"

namespace dtr::sfm {

/// The note beside a file of features that says how much of it is whole (Workspace::Keep).
std::filesystem::path NoteOf(const std::filesystem::path& file);

/// The file of a part, beside the one of all.
std::filesystem::path PartOf(const std::filesystem::path& all, const Part& part);

/// What lies in files of parts whose notes have the fingerprint of the step that runs.
class FeatureParts {
 public:
  /// Takes over what the parts cost, too. Throws Error where a file with such a note is damaged.
  FeatureParts(Workspace& workspace, const std::filesystem::path& all);

  /// Features of a photo; nothing where no part has them. Called from any thread.
  std::optional<Features> Of(size_t photo) const;

  /// Removes the files of all parts, and what else lies beside them.
  void Remove() const;

 private:
  std::filesystem::path all_;
  std::vector<FeatureFile> parts_;
};

}  // namespace dtr::sfm
