// cli/pipeline/input_hash.h -- whether an input is the one that an interrupted run began with.
#pragma once
#include <filesystem>
#include <string>

namespace dtr::pipeline {

/// SHA-256 (hex) of a file or of all names and files below a folder; "" for an empty path.
std::string InputHash(const std::filesystem::path& input);

}  // namespace dtr::pipeline
