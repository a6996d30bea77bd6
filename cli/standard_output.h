// cli/standard_output.h -- results, which must be written before a command counts as done, and
// messages.
#pragma once
#include <string>

namespace dtr::cli {

/// Writes to standard output, at once. Throws Error where not all of it can be written (a full
/// disk).
void WriteOut(const std::string& text);

/// Writes to standard error. Where that cannot be written (a log on a full disk, a closed
/// descriptor), the text is lost and the work goes on.
void WriteErr(const std::string& text) noexcept;

}  // namespace dtr::cli
