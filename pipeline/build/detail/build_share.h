// pipeline/build/detail/build_share.h -- what of a build this process does, and with whom.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/build/build.h"
#include "pipeline/build/detail/part_files.h"

namespace dtr::pipeline {

class BuildShare {
 public:
  /// Throws UsageError where options.part is no part of such a build.
  explicit BuildShare(const BuildOptions& options) : part_(options.part) {
    if (!part_) return;
    const auto stages = BuildStages(options);
    RequirePart(*part_, stages);
    is_shared_ = IsShared(*part_, stages);
    for (const BuildStage& stage : stages) passes_ += stage.name.starts_with("pass-");
  }

  /// Other processes work on the set at the same time.
  bool is_shared() const { return is_shared_; }
  bool Is(const char* stage) const { return part_ && part_->stage == stage; }
  /// Ends the run (PartDone) where this stage was all that was asked for.
  void EndAfter(const char* stage) const {
    if (Is(stage)) throw PartDone();
  }

  io::SetWriter OpenWriter(const BuildOptions& options, const std::string& fingerprint) const {
    if (is_shared_) return io::SetWriter::Join(options.output, fingerprint, options.force);
    return {options.output, fingerprint, options.force};
  }
  /// Until the end, no other process does this part.
  void Lock(const std::filesystem::path& work) {
    if (part_) lock_ = LockPart(work, *part_);
  }

  /// Of each stage what this process does.
  std::optional<sfm::SfmPart> Sfm() const {
    return part_ ? SfmPartOf(*part_) : std::optional<sfm::SfmPart>();
  }
  Part Undistortion() const {
    if (Is("undistortion")) return part_->part;
    return is_shared_ ? Part{0, 0} : Part{};
  }
  std::optional<DepthStagePart> Depth() const {
    return part_ ? DepthPartOf(*part_, passes_) : std::optional<DepthStagePart>();
  }

 private:
  std::optional<BuildPart> part_;
  bool is_shared_ = false;
  int passes_ = 0;
  std::optional<FileLock> lock_;
};

}  // namespace dtr::pipeline
