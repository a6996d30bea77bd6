// pipeline/core/photos/rig_names.h -- which camera of a rig took a photo, and when, by the
// photo's name.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace dtr::pipeline {

/// A camera of a rig and a time step, as names say them.
struct RigName {
  std::string camera, frame;
};

/// The digits at the end of a name; empty where there are none.
std::string DigitsAtEnd(const std::string& name);

/// Of a photo in a folder, "left/0012.jpg", the folder's name and the photo's without extension; of
/// one beside the others, "left0012.jpg", what stands before the number, and the number. `name`:
/// below the folder of all photos, '/' between parts. Empty where it has neither form.
std::optional<RigName> RigNameOf(const std::string& name);

/// When frames were taken, by their names in order of time: where all are numbers, perhaps after
/// the same words, the numbers, from 0 on and in units of their greatest common step, so that a
/// frame that is missing leaves a gap; else their places among the names. Numbers far apart (more
/// than 100 times as many as names) are no count of frames, and places, too.
std::vector<size_t> FrameTimes(const std::vector<std::string>& names);

}  // namespace dtr::pipeline
