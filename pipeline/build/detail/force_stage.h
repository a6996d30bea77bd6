// pipeline/build/detail/force_stage.h -- stages of an interrupted build that are to be done again.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace dtr::pipeline {

/// Removes what the stage `name` and all after it left in the partial set `folder` (io::SetWriter),
/// so that the run does them again. Throws UsageError for a name not in StagesKept
/// (pipeline/build/build.h), Error when a file cannot be removed.
void ForgetStage(const std::filesystem::path& folder, const std::string& name);

}  // namespace dtr::pipeline
