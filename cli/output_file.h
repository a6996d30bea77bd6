// cli/output_file.h -- outputs that cannot be written are rejected before the work, not after it.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace dtr::cli {

/// Throws UsageError unless the folder that `file` would lie in exists. `option` is named.
void RequireFolderOf(const std::filesystem::path& file, const std::string& option);

/// Extension of a file name in lower case, with the dot: ".png" of "VIEW.PNG".
std::string LowerExtension(const std::filesystem::path& file);

/// RequireFolderOf, and the name must end in one of `extensions` (with the dot, lower case; any
/// case passes).
void RequireOutputFile(const std::filesystem::path& file, const std::string& option,
                       const std::vector<std::string>& extensions);

}  // namespace dtr::cli
