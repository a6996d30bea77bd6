// pipeline/build/build_part.h -- a build that several processes share, on one machine or on many
// that see the same folders.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/part.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

struct BuildOptions;

/// A stage of a build that a process of its own can do: everything before it must be done.
struct BuildStage {
  std::string name;
  /// Several processes may share it, each with a part of its photos, pairs or views. Else one does
  /// it, and none works on the set beside it.
  bool has_parts = false;
};

/// The stages of a build with these options, in their order; what is left after the last of them
/// BuildSet does, which also does whatever was left out. Throws UsageError for options with which
/// work cannot be shared.
std::vector<BuildStage> BuildStages(const BuildOptions& options);

/// One part of one stage.
struct BuildPart {
  std::string stage;
  Part part;
};

/// Does this alone, of a build that others of the same options began or will end; the set is not
/// there yet when it returns. Throws as BuildSet, UsageError where it is no part of such a build or
/// another process is at it, Error where a stage before it is not done.
void RunBuildPart(const BuildOptions& options, const BuildPart& part, Progress& progress);

/// "STAGE" or "STAGE, part 3 of 8".
std::string NameOf(const BuildPart& part);

/// What a part that is done leaves behind, in the work folder of the set.
struct DonePart {
  double wall_s = 0, cpu_s = 0;
};
/// Of the set `output` that is being built; nothing where the part is not done. Throws Error where
/// the record cannot be read.
std::optional<DonePart> FindDonePart(const std::filesystem::path& output, const BuildPart& part);

}  // namespace dtr::pipeline
