// pipeline/build/detail/part_files.h -- what processes that share a build leave for each other.
#pragma once
#include <filesystem>
#include <optional>

#include "dtr/base/durable.h"
#include "dtr/io/set_io.h"
#include "pipeline/build/build_part.h"
#include "pipeline/core/calibrate.h"

namespace dtr::pipeline {

/// Rejects a stage that the build does not have, a part that is none, and parts of a stage that one
/// process does. Throws UsageError.
void RequirePart(const BuildPart& part, const std::vector<BuildStage>& stages);

/// Held while a part is worked on: throws UsageError where another process does.
FileLock LockPart(const std::filesystem::path& work, const BuildPart& part);

/// A mark that the build was begun, where a stage leaves nothing else for the next.
void MarkBegun(const std::filesystem::path& work);

/// Says that a part is done, and what it took.
void WriteDonePart(const std::filesystem::path& work, const BuildPart& part, const DonePart& done);
/// What all parts of the stage took; 0 where there are none.
DonePart TotalOf(const std::filesystem::path& work, const std::string& stage);
/// Whether there are records of any.
bool HasParts(const std::filesystem::path& work);

/// Freezes cameras for the stages after them: model, unit, origin and the photos without a camera.
void FreezeCalibration(const CalibratedPhotos& calibrated, const std::filesystem::path& work);
/// What FreezeCalibration wrote, to the bit, without the report. Throws Error where there is none.
CalibratedPhotos FrozenCalibration(const std::filesystem::path& work);

}  // namespace dtr::pipeline
