// cli/pipeline/rig_timestamps.h -- which frames of videos are of one instant, as a table says.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace dtr::pipeline {

/// (cam_id, frame_index) -> sync_index.
using RigInstants = std::map<std::pair<int, int>, int>;

/// Comma-separated lines under a heading with the columns sync_index, cam_id and frame_index, in
/// any order and among others. Throws Error naming file, line and column.
RigInstants ReadRigTimestamps(const std::filesystem::path& file);

/// A number from 0 on without sign or fraction; empty where `word` is anything else.
std::optional<int> WholeNumber(const std::string& word);

}  // namespace dtr::pipeline
