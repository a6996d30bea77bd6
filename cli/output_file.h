// cli/output_file.h -- outputs that cannot be written, or would be written over what is not ours,
// are rejected before the work, not after it.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace dtr::cli {

/// Throws UsageError unless the folder that `file` would lie in exists. `option` is named.
void RequireFolderOf(const std::filesystem::path& file, const std::string& option);

/// RequireFolderOf, and the name must end in one of `extensions` (with the dot, lower case; any
/// case passes).
void RequireOutputFile(const std::filesystem::path& file, const std::string& option,
                       const std::vector<std::string>& extensions);

/// Checks every output that the command line names, after parsing: --json and --output (also as two
/// names of one file), and the options of single commands (kOutputOptions). Throws UsageError for
/// an output
/// - inside a D+TR set, or in the place of one, unless the command writes sets;
/// - in the place of a file that is an input: named by another option, or in a folder that is;
/// - in the place of any other file with content, unless `force`.
/// Pipes, devices and what lies below /dev are written in place and pass. Folders pass as well: who
/// writes several files into one checks each (pipeline/core/run/output_folder.h).
void RequireOutputs(const CLI::App& command, bool force);

}  // namespace dtr::cli
