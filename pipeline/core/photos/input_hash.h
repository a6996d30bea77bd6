// pipeline/core/photos/input_hash.h -- whether an input is the one that an interrupted run began
// with.
#pragma once
#include <filesystem>
#include <span>
#include <string>

namespace dtr::pipeline {

/// SHA-256 (hex) of a file or of all names and files below a folder, but for folders of what we
/// made ourselves (capture::IsOwnFolder): the output may lie there. "" for an empty path.
std::string InputHash(const std::filesystem::path& input);

/// SHA-256 (hex) of these files and their names.
std::string InputHash(std::span<const std::filesystem::path> files);

}  // namespace dtr::pipeline
