// cli/arguments.h -- what every word of a command line must be.
#pragma once
#include <string>
#include <vector>

namespace dtr::cli {

/// Throws UsageError for words that are no UTF-8 or have control characters: they come back in
/// JSON, in the record of the run and in messages of one line, which hold nothing else.
void RequirePlainArguments(const std::vector<std::string>& arguments);

}  // namespace dtr::cli
