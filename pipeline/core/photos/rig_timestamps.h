// pipeline/core/photos/rig_timestamps.h -- which frames of videos are of one time step, as a
// table says.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace dtr::pipeline {

/// (cam_id, frame_index) -> sync_index.
using RigTimeSteps = std::map<std::pair<int, int>, int>;

struct RigTimestamps {
  RigTimeSteps time_steps;
  /// True where the table has no column frame_index: frames are then the rows of a camera, counted
  /// from 0 in the order of sync_index.
  bool counted = false;
};

/// A table under a heading with the columns sync_index, cam_id and, where the program that wrote it
/// had it, frame_index; in any order and among others. Cells are separated by commas, semicolons or
/// tabs, may be quoted, and whole numbers may end in ".0" as data frames write them. A row whose
/// frame_index is empty or not a number, or without that column its frame_time, says that the
/// camera has no frame then. Throws Error naming file, line and column, also where a camera has two
/// rows of one frame that contradict each other.
RigTimestamps ReadRigTimestamps(const std::filesystem::path& file);

/// A number from 0 on without sign or fraction; empty where `word` is anything else.
std::optional<int> WholeNumber(const std::string& word);

}  // namespace dtr::pipeline
