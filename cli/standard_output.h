// cli/standard_output.h -- results that must have been told before a command counts as done.
#pragma once
#include <string>

namespace dtr::cli {

/// Writes to standard output, at once. Throws Error where not all of it can be written (a full
/// disk).
void WriteOut(const std::string& text);

}  // namespace dtr::cli
